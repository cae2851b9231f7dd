"""Where runs are written."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path

from twin.files.writing import make_folder, written_alone


def run_folder(scenario: str) -> Path:
    """Create and return `runs/<scenario>/<YYYYmmdd-HHMMSS>`, with a counter if that second is taken."""
    name = datetime.now().strftime("%Y%m%d-%H%M%S")
    parent = make_folder(Path("runs") / scenario)
    for suffix in ("", *(f"-{count}" for count in range(2, 1000))):
        folder = parent / (name + suffix)
        try:
            folder.mkdir()
        except FileExistsError:
            continue
        return folder
    raise FileExistsError(f"{parent / name}: a thousand runs were started in this second")


@contextmanager
def results_folder(out: Path | None, name: str) -> Iterator[Path]:
    """Make the folder of the results, `out` or `runs/<name>/<time>`, and keep other processes from it.

    Raises:
        RecordingError: It cannot be made, or another process is writing there.
    """
    folder = run_folder(name) if out is None else make_folder(out)
    with written_alone(folder):
        yield folder


def bag_folder() -> Path:
    """Return `rosbag2_<YYYY_mm_dd-HH_MM_SS>`, as `ros2 bag record` names a bag."""
    return Path(datetime.now().strftime("rosbag2_%Y_%m_%d-%H_%M_%S"))


def map_name() -> Path:
    """Return `map_<seconds>`, as nav2's map_saver_cli names a map."""
    return Path(f"map_{int(datetime.now().timestamp())}")
