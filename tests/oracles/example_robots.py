"""The robots of example-robot-data held to pinocchio; `make oracle` writes them to docs/fidelity.md."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.oracles.installed import example_robots
from tests.oracles.pinocchio_oracle import Errors, compare
from twin.convert import Base, convert
from twin.errors import TwinError
from twin.models import load
from twin.models.description import RobotDescription

PAGE = Path(__file__).parents[2] / "docs" / "fidelity.md"
BEGIN, END = "<!-- robots: begin -->\n", "<!-- robots: end -->\n"


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What became of one file."""

    file: Path
    description: RobotDescription | None = None
    errors: Errors | None = None
    """None if it was refused."""
    refusal: str = ""


def outcomes(base: Base) -> Iterator[Outcome]:
    """Convert and compare them one by one; with a free base, what is only seen is read too."""
    for file in example_robots():
        try:
            description = load(file)
            model = convert(description, base=base, visuals=base == "free").spec.compile()
        except TwinError as fault:
            yield Outcome(file=file, refusal=str(fault))
            continue
        yield Outcome(file=file, description=description, errors=compare(model, description))
