"""Writes the page of pictures of the scenarios that ship: two views of a recording of each.

python docs/gallery.py [SCENARIO ...]

Names of scenarios draw only theirs again. Pictures need a Vulkan driver, but no display.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

from PIL import Image, ImageOps

import twin
from twin.recording.player import screenshot
from twin.scenario.schema import load

DOCS = Path(__file__).parent
HEIGHT, WIDTHS, GAP = 240, (560, 360), 8
"""Of a picture, of its two views, and between them [pixels]."""
MOST_BYTES = 60_000


class Shot(NamedTuple):
    """What is shown of a scenario."""

    scenario: str
    """Its file, below `scenarios`."""
    time_s: float
    view: str
    """Beside the map."""
    caption: str


SHOTS = (
    Shot("warehouse", 44.0, "warehouse_bot", "with the tote on its way to the unloading zone."),
    Shot(
        "warehouse_blocked_aisle", 40.0, "warehouse_bot", "the crate is seen; the plan leads around the rack."
    ),
    Shot(
        "warehouse_three_totes",
        60.0,
        "Simulation",
        "the first tote goes onto the table, two wait in their racks.",
    ),
    Shot("warehouse_patrol", 60.0, "Simulation", "orange boxes are people who walk."),
    Shot("warehouse_lost", 12.0, "warehouse_bot", "it has found itself, and is on its way."),
    Shot("warehouse_charger", 22.0, "warehouse_bot", "at the charger."),
    Shot("warehouse_slam", 60.0, "warehouse_bot", "grey is what it has not seen yet."),
    Shot("warehouse_kidnapped", 20.0, "warehouse_bot", "carried away, and found again: its trail leaps."),
    Shot("warehouse_lidar_lost", 12.0, "warehouse_bot", "the first failure is over, and it drives on."),
    Shot(
        "warehouse_wrong_map",
        10.0,
        "warehouse_bot",
        "the rack ahead is half a metre from where its map has it.",
    ),
    Shot("diff_bot_figure8", 24.0, "Simulation", "on the second circle."),
    Shot("sp1s_square", 20.0, "sp1s", "at the third corner."),
    Shot("r2d2_circle", 30.0, "r2d2", "the head turns, the body leans."),
    Shot(
        "cameras/warehouse_table",
        8.0,
        "warehouse_bot",
        "blue points are what its depth camera sees; the plan leads around the table.",
    ),
    Shot("failing/warehouse_dropped_tote", 32.0, "warehouse_bot", "the tote slips out of the grip."),
)


def draw(shot: Shot, file: Path) -> None:
    """Run a scenario until its picture, and write it."""
    with tempfile.TemporaryDirectory() as folder:
        with twin.Simulation(_file(shot), out=Path(folder)) as simulation:
            simulation.run_until(shot.time_s + 1.0)
        (recording,) = Path(folder).glob("*.rrd")
        whole = Image.new("RGB", (WIDTHS[0] + GAP + WIDTHS[1], HEIGHT), "white")
        for view, width, left in ((shot.view, WIDTHS[0], 0), ("Map", WIDTHS[1], WIDTHS[0] + GAP)):
            screenshot(recording, Path(folder) / "view.png", time_s=shot.time_s, view=view)
            with Image.open(Path(folder) / "view.png") as picture:
                whole.paste(ImageOps.fit(picture.convert("RGB"), (width, HEIGHT)), (left, 0))
    whole.save(file, quality=80, optimize=True)
    if file.stat().st_size > MOST_BYTES:
        raise SystemExit(f"{file}: {file.stat().st_size} bytes; valid: at most {MOST_BYTES}")


def page() -> str:
    """Return the page."""
    parts = [
        "# The scenarios in pictures\n",
        "Each that [ships](scenarios.md), at a moment of its [recording](recording.md): a view of the",
        "simulation, and the map as the robot has it.",
        "`python docs/gallery.py` writes this page and its pictures.\n",
    ]
    for shot in SHOTS:
        picture = _picture(shot).relative_to(DOCS).as_posix()
        parts += [
            f"## {_name(shot)}\n",
            f"{load(_file(shot)).description} At {shot.time_s:.0f} s: {shot.caption}\n",
            f"![{_name(shot)}]({picture})\n",
        ]
    return "\n".join(parts)


def _name(shot: Shot) -> str:
    return Path(shot.scenario).name


def _file(shot: Shot) -> Path:
    return DOCS.parent / "scenarios" / f"{shot.scenario}.yaml"


def _picture(shot: Shot) -> Path:
    return DOCS / "gallery" / f"{_name(shot)}.jpg"


if __name__ == "__main__":
    for each in SHOTS:
        if len(sys.argv) == 1 or _name(each) in sys.argv[1:]:
            draw(each, _picture(each))
    (DOCS / "gallery.md").write_text(page(), encoding="utf-8")
