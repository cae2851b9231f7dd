"""The robots of example-robot-data held to pinocchio; `make oracle` writes them to docs/fidelity.md."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import mujoco

from tests.oracles.installed import example_robots
from tests.oracles.pinocchio_oracle import Errors, compare
from twin.convert import Base, convert
from twin.convert.export import export
from twin.errors import TwinError
from twin.models import load
from twin.models.description import RobotDescription

PAGE = Path(__file__).parents[2] / "docs" / "fidelity.md"
BEGIN, END = "<!-- robots: begin -->\n", "<!-- robots: end -->\n"
EXACT = 1e-12
"""Below this, differences are rounding."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What became of one file."""

    file: Path
    description: RobotDescription | None = None
    errors: Errors | None = None
    """None if it was refused."""
    refusal: str = ""
    """All that was said."""


def outcomes(base: Base) -> Iterator[Outcome]:
    """Convert and compare them one by one; with a free base, what `twin convert` writes is compared."""
    for file in example_robots():
        try:
            description = load(file)
            model = _written(description) if base == "free" else _built(description)
        except TwinError as fault:
            yield Outcome(file=file, refusal=str(fault))
            continue
        yield Outcome(file=file, description=description, errors=compare(model, description))


def _written(description: RobotDescription) -> mujoco.MjModel:
    with tempfile.TemporaryDirectory() as folder:
        export(description, Path(folder) / "out")
        return mujoco.MjModel.from_xml_path(f"{folder}/out/robot.xml")


def _built(description: RobotDescription) -> mujoco.MjModel:
    return convert(description, base="fixed", visuals=False).spec.compile()


def table() -> str:
    """Return the outcomes as Markdown: one row for each robot, the worse of a fixed and a free base."""
    rows = [
        "| Robot | Links | Joints | Kinematics | Mass matrix | Gravity | Coriolis | Notes |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for fixed, free in zip(outcomes("fixed"), outcomes("free"), strict=True):
        name = f"{fixed.file.parent.parent.name}/{fixed.file.name}".replace("_description", "")
        if fixed.errors is None or free.errors is None or fixed.description is None:
            rows.append(f"| {name} | | | | | | | refused: {_reason(fixed.refusal or free.refusal)} |")
            continue
        pairs = zip(_parts(fixed.errors), _parts(free.errors), strict=True)
        worst = " | ".join(_shown(max(pair)) for pair in pairs)
        links, joints = len(fixed.description.links), len(fixed.description.joints)
        rows.append(f"| {name} | {links} | {joints} | {worst} | {_notes(fixed.description)} |")
    return "\n".join(rows) + "\n"


def _parts(errors: Errors) -> tuple[float, ...]:
    return errors.kinematics, errors.mass_matrix, errors.gravity, errors.bias


def _shown(value: float) -> str:
    return "exact" if value < EXACT else f"{value:.0e}"


def _notes(description: RobotDescription) -> str:
    settlement = description.settlement
    counted = {
        "lumped": len(settlement.lumped),
        "point or rounded inertia": len(settlement.repaired),
        "massless but carrying": len(settlement.massless_carriers),
    }
    return ", ".join(f"{number} {what}" for what, number in counted.items() if number)


def _reason(refusal: str) -> str:
    """Return the first sentence that is not about a mesh of another computer, without its place."""
    lines = [line for line in refusal.splitlines() if "mesh '" not in line] or refusal.splitlines()
    message = lines[0].partition(".urdf:")[2].partition(";")[0]
    return message.lstrip("0123456789").removeprefix(":").strip()


def main() -> None:
    """Write the table into the page."""
    text = PAGE.read_text("utf-8")
    head, _, rest = text.partition(BEGIN)
    tail = rest.partition(END)[2]
    PAGE.write_text(f"{head}{BEGIN}\n{table()}\n{END}{tail}", encoding="utf-8")


if __name__ == "__main__":
    main()
