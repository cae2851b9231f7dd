"""What an annotation may say of a parameter beside its unit and its bound."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, get_args

from twin.parameters.units import Hertz, Seconds, Unit


@dataclass(frozen=True)
class Form:
    """How a value that a config keeps is told to others: bounds and unit are of what is told."""

    unit: Unit
    suffix: str
    """What the field's name ends with ..."""
    told_as: str
    """... and the parameter's instead."""
    tell: Callable[[Any], float]
    read: Callable[[float], Any]


@dataclass(frozen=True)
class Name:
    """The parameter's name, where the field's cannot be it; of a config inside, that of its section."""

    name: str


@dataclass(frozen=True)
class Nav2:
    """How Nav2's files write the parameter, where it is otherwise; a field may have several."""

    name: str = ""
    """Another name, below the section of the config; '': the same."""
    read: Callable[[Any], Any] = lambda value: value
    """Takes what a file says, whatever that is, and returns what is meant."""


def renamed(**names: str) -> Callable[[Any], Any]:
    """Return a `Nav2.read` of other names for some choices."""
    return lambda value: names.get(value, value) if isinstance(value, str) else value


@dataclass(frozen=True)
class Marker:
    """A property of a parameter that is there or not."""

    meaning: str


Flat = Name("")
"""Of a config inside, or of configs by name: without a section of its own."""
Underscored = Marker("of configs by name: their sections end with _ instead of ., as in odom0_config")
Itself = Marker("the parameter is called as the section that it is in: odom0")
ReadOnly = Marker("live setting does not change it")
Derived = Marker("made of other parameters: scenarios have no key for it")
MayBeInfinite = Marker("infinity is valid")
NameOrPath = Marker("the name of what ships, or a path, in a scenario relative to its file")

_HERTZ, _SECONDS = get_args(Hertz)[1], get_args(Seconds)[1]

PeriodNs = Annotated[
    int, Form(_HERTZ, "period_ns", "frequency", lambda ns: 1e9 / ns, lambda hz: round(1e9 / hz))
]
"""A period [ns], which is told as a frequency: `controller_period_ns` is `controller_frequency` [Hz]."""
DurationNs = Annotated[int, Form(_SECONDS, "_ns", "", lambda ns: ns * 1e-9, lambda s: round(s * 1e9))]
"""A time [ns], which is told in seconds: `failure_tolerance_ns` is `failure_tolerance` [s]."""
