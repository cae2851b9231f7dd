"""Checks that are formulas of signal temporal logic over signals; docs/checks.md says what they mean."""

from __future__ import annotations

import math
from typing import Annotated

from twin.parameters import Metres, NotNegative, Positive, Radians, Seconds
from twin.scenario.checks.check import CheckConfig
from twin.scenario.checks.signal_check import SignalCheck
from twin.scenario.checks.statement import FormulaModel, Statement, StatementOrText
from twin.scenario.observation import CheckContext
from twin.scenario.signals.reference import Reference
from twin.scenario.temporal import (
    FOREVER,
    Always,
    And,
    Finally,
    Formula,
    Until,
    Window,
    eventually,
    implies,
    never,
)
from twin.strict_yaml import Fault, Faults


class TemporalConfig(FormulaModel, CheckConfig):
    """A check that is a formula."""

    label: str | None = None
    """What the verdict calls the check; absent: its kind and formula."""
    robot: str | None = None
    """The robot whose signals are meant where none is named; may be left out if there is only one."""

    @property
    def subject(self) -> str:
        """What the verdict calls it, after the name of the kind."""
        return self.words()


class WindowConfig(TemporalConfig):
    """A formula over a time."""

    after: Annotated[Seconds, NotNegative] = 0.0
    """Begin of the time that counts [s]."""
    before: Annotated[Seconds, NotNegative] | None = None
    """End of that time, included [s]; absent: that of the run."""

    @property
    def window(self) -> Window:
        """The time that counts; raises Faults."""
        if self.before is not None and self.before < self.after:
            said = f"before ({self.before:g} s) must not be less than after ({self.after:g} s)"
            raise Faults([Fault(("before",), said)])
        return Window(_ns(self.after), FOREVER if self.before is None else _ns(self.before))

    @property
    def subject(self) -> str:
        """What the verdict calls it, after the name of the kind."""
        end = "inf" if self.before is None else f"{self.before:g}"
        return self.words() + (f", {self.after:g} to {end} s" if self.after or self.before else "")


class AlwaysConfig(Statement, WindowConfig):
    """A statement holds all the time."""

    def formula(self) -> Formula:
        """Return what it means; raises Faults."""
        return Always(super().formula(), self.window)


class NeverConfig(Statement, WindowConfig):
    """A statement holds at no time."""

    def formula(self) -> Formula:
        """Return what it means; raises Faults."""
        return never(super().formula(), self.window)


class EventuallyConfig(Statement, WindowConfig):
    """A statement holds at some time."""

    def formula(self) -> Formula:
        """Return what it means; raises Faults."""
        return eventually(super().formula(), self.window)


class FinallyConfig(Statement, TemporalConfig):
    """A statement holds at the end."""

    def formula(self) -> Formula:
        """Return what it means; raises Faults."""
        return Finally(super().formula())


class FormulaConfig(TemporalConfig):
    """A formula holds: `always[0, 60](clearance > 5 cm) and eventually speed > 0.3`."""

    takes_text = True
    that: str
    """The formula; a text alone in the place of the mapping is it, too."""

    def formula(self) -> Formula:
        """Return what it means; raises Faults."""
        return self.parsed("that", self.that)

    def words(self) -> str:
        """Return it in one line."""
        return " ".join(self.that.split())


class UntilConfig(WindowConfig):
    """One statement holds until another one does, which must come."""

    first: StatementOrText
    """What holds up to then."""
    then: StatementOrText
    """What ends it, in the time that counts."""

    def formula(self) -> Formula:
        """Return what it means; raises Faults."""
        return Until(self.first.formula(), self.then.formula(), self.window)

    def words(self) -> str:
        """Return both."""
        return f"{self.first.words()}, then {self.then.words()}"


class WithinConfig(WindowConfig):
    """Whenever one statement holds, another one does soon after."""

    time: Annotated[Seconds, Positive]
    """How soon [s]."""
    of: StatementOrText
    """What calls for it, in the time that counts."""
    then: StatementOrText
    """What must follow."""

    def formula(self) -> Formula:
        """Return what it means; raises Faults."""
        soon = eventually(self.then.formula(), Window(0, _ns(self.time)))
        return Always(implies(self.of.formula(), soon), self.window)

    def words(self) -> str:
        """Return both."""
        return f"{self.time:g} s of {self.of.words()}, {self.then.words()}"


class ReachesConfig(WindowConfig):
    """A robot's base comes to a place, at some time."""

    x: Metres | None = None
    """Of the place, along x of `map` [m]."""
    y: Metres | None = None
    """Along y of `map` [m]."""
    yaw: Radians | None = None
    """Heading there [rad]; absent: any."""
    zone: str | None = None
    """A zone of the arena, instead of x and y."""
    tolerance: Annotated[Metres, NotNegative] = 0.1
    """Largest distance from the place, or from the zone [m]."""
    yaw_tolerance: Annotated[Radians, Positive] = math.radians(10.0)
    """Largest heading error [rad]."""

    def formula(self) -> Formula:
        """Return what it means; raises Faults."""
        point = None if self.x is None or self.y is None else f"distance_to({self.x!r}, {self.y!r})"
        if (point is None) == (self.zone is None) or (point is None and (self.x or self.y) is not None):
            raise Faults([Fault((), "must have either the keys x and y, or zone")])
        near = self.compared(point or f"distance_to_zone({self.zone})", "<=", self.tolerance)
        if self.yaw is not None:
            near = And((near, self.compared(f"turned_from({self.yaw!r})", "<=", self.yaw_tolerance)))
        return eventually(near, self.window)

    def words(self) -> str:
        """Return the place."""
        return f"{self.x:g}, {self.y:g}" if self.zone is None else self.zone


def _ns(seconds: float) -> int:
    return round(seconds * 1e9)


class TemporalCheck(SignalCheck):
    """The formula of a file, named by its label if it has one."""

    config: TemporalConfig

    def __init__(self, name: str, config: TemporalConfig, context: CheckContext) -> None:
        super().__init__(config.label or name, config, context)

    def formula(self) -> Formula:
        """Return what the file says."""
        return self.config.formula()

    def reference(self, signal: str) -> Reference:
        """Return what a name of a signal means in the file."""
        return self.config.reference(signal)


def _check(config: type[TemporalConfig]) -> type[TemporalCheck]:
    name = config.__name__.replace("Config", "Check")
    return type(name, (TemporalCheck,), {"Config": config, "__doc__": config.__doc__, "__module__": __name__})


AlwaysCheck = _check(AlwaysConfig)
NeverCheck = _check(NeverConfig)
EventuallyCheck = _check(EventuallyConfig)
FinallyCheck = _check(FinallyConfig)
FormulaCheck = _check(FormulaConfig)
UntilCheck = _check(UntilConfig)
WithinCheck = _check(WithinConfig)
ReachesCheck = _check(ReachesConfig)
