"""What a comparison of two runs finds."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

PHYSICS = "physics"
"""Stands for a topic where the physics state differs."""
Value = bool | float | int | str | None


@dataclass(frozen=True, kw_only=True)
class Divergence:
    """Where one topic, or the physics, first differs."""

    topic: str
    """Its name, or `physics`."""
    type: str
    """Of the messages."""
    time_ns: int
    """Simulated time of the message or physics step [ns]."""
    tick: int
    """Control tick of the message or step, from 1; 0: published while nodes were made."""
    field: str
    """Such as `twist.twist.linear.x`; empty: there is a message in one run only."""
    a: Value
    """What it is in the first run; None: there is nothing."""
    b: Value
    """In the second."""
    fields: int = 1
    """How many fields or elements of that message differ."""

    @property
    def change(self) -> float | None:
        """How much larger it is in the second run; None if it is no number."""
        both = (self.a, self.b)
        numbers = [value for value in both if isinstance(value, int | float) and not isinstance(value, bool)]
        return float(numbers[1] - numbers[0]) if len(numbers) == 2 else None


@dataclass(frozen=True, kw_only=True)
class Change:
    """What differs in how two runs were made."""

    key: str
    """Dotted key of the scenario, `version of mujoco`, `file robot.urdf`, ..."""
    a: Value
    b: Value


@dataclass(frozen=True, kw_only=True)
class Difference:
    """Whether two runs were the same run, and if not, where they part."""

    a: str
    """What the first run is called."""
    b: str
    digest_a: str | None
    """None: the run was not finished."""
    digest_b: str | None
    same: bool
    changes: tuple[Change, ...] = ()
    """What differs in how they were made: the causes, if anything is deterministic."""
    second: int | None = None
    """The hashes differ first in the ticks that end after so many seconds; None if they do not."""
    topics: tuple[str, ...] = ()
    """Topics with types whose hashes differ in that second."""
    first: tuple[Divergence, ...] = ()
    """In the order of time: each topic's first difference in that second, and that of the physics."""
    notes: tuple[str, ...] = ()
    """Sentences on what could not be found out."""

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return asdict(self) | {"first": [asdict(one) | {"change": one.change} for one in self.first]}
