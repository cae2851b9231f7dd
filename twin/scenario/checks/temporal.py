"""Checks that are formulas of signal temporal logic over signals; docs/checks.md says what they mean."""

from __future__ import annotations

import math
from typing import Annotated

from twin.errors import ScenarioError
from twin.parameters import Metres, NotNegative, Positive, Radians, Seconds
from twin.scenario.checks.check import NOTHING, Check, CheckConfig, CheckResult
from twin.scenario.checks.statement import FormulaModel, Statement, StatementOrText
from twin.scenario.observation import CheckContext, Observation
from twin.scenario.signals import Signal
from twin.scenario.signals.topics import TopicReader
from twin.scenario.temporal import (
    FOREVER,
    Always,
    And,
    Formula,
    Margin,
    Monitor,
    Predicate,
    Until,
    Window,
    eventually,
    implies,
    never,
)
from twin.scenario.temporal.formula import Value, begins_ns
from twin.strict_yaml import Fault, Faults


class TemporalConfig(FormulaModel, CheckConfig):
    """A check that is a formula."""

    robot: str | None = None
    """The robot whose signals are meant where none is named; may be left out if there is only one."""
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


class SpanConfig(Statement, TemporalConfig):
    """A statement over a time."""


class AlwaysConfig(SpanConfig):
    """A statement holds all the time."""

    def formula(self) -> Formula:
        """Return what it means; raises Faults."""
        return Always(super().formula(), self.window)


class NeverConfig(SpanConfig):
    """A statement holds at no time."""

    def formula(self) -> Formula:
        """Return what it means; raises Faults."""
        return never(super().formula(), self.window)


class EventuallyConfig(SpanConfig):
    """A statement holds at some time."""

    def formula(self) -> Formula:
        """Return what it means; raises Faults."""
        return eventually(super().formula(), self.window)


class FormulaConfig(FormulaModel, CheckConfig):
    """A formula holds: `always[0, 60](clearance > 5 cm) and eventually speed > 0.3`."""

    takes_text = True
    that: str
    """The formula; a text alone in the place of the mapping is it, too."""
    robot: str | None = None
    """The robot whose signals are meant where none is named; may be left out if there is only one."""

    def formula(self) -> Formula:
        """Return what it means; raises Faults."""
        return self.parsed("that", self.that)

    def words(self) -> str:
        """Return it in one line."""
        return " ".join(self.that.split())

    subject = property(words)


class UntilConfig(TemporalConfig):
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


class WithinConfig(TemporalConfig):
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


class ReachesConfig(TemporalConfig):
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


class TemporalCheck(Check):
    """A monitor of the formula, and the signals that it takes."""

    config: TemporalConfig | FormulaConfig
    _at_s: float | None = None
    _last_s: float | None = None

    def __init__(self, name: str, config: TemporalConfig | FormulaConfig, context: CheckContext) -> None:
        super().__init__(name, config, context)
        self._formula = config.formula()
        self._monitor = Monitor(self._formula)
        self._references = {text: config.reference(text) for text in self._monitor.signals}
        self._signals: dict[str, Signal] = {}
        self.topics: dict[str, TopicReader] = {}
        self._unseen = dict.fromkeys(self._references)
        for text, reference in self._references.items():
            if reference.field is None:
                self._signals[text] = reference.make(config.robot, context)
            else:
                self.topics[text] = reference.field.reader(context.topic_type(reference.field.topic))
        self.needs = frozenset(signal.needs for signal in self._signals.values()) - {""}
        for predicate in self._monitor.predicates:
            self._check_kind(predicate)

    def _check_kind(self, predicate: Predicate) -> None:
        """Raise ScenarioError if a signal is compared with what it is not."""
        text = predicate.signal
        kind = self.topics[text].kind if text in self.topics else self._signals[text].kind
        if type(predicate.limit) is not kind or (
            kind is not float and predicate.relation not in ("==", "!=")
        ):
            words = {float: "a number", bool: "true or false", str: "a text"}
            compared = f"{predicate.relation} {predicate.limit!r}"
            raise ScenarioError(f"{text} is {words[kind]}, and cannot be compared by {compared}")

    def take(self, signal: str, time_ns: int, value: Value) -> None:
        """Take a value of a signal."""
        self._unseen.pop(signal, None)
        self._monitor.take(signal, time_ns, value)

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        self._last_s = observation.time_s
        for text, signal in self._signals.items():
            value = signal.value(observation)
            if value is not None:
                self.take(text, observation.time_ns, value)
        self._monitor.know(observation.time_ns)
        if self._at_s is None and self._monitor.verdict is not None:
            self._at_s = observation.time_s

    @property
    def decided(self) -> bool | None:
        """Whether it holds, whatever comes; None: that is open."""
        return self._monitor.verdict

    def result(self) -> CheckResult:
        """Return the outcome, the run being over; value, limit and unit are those of the worst moment."""
        begin = begins_ns(self._formula) / 1e9
        at_s = self._last_s if self._at_s is None else self._at_s
        if self._last_s is None:
            return self._judged("the run made no step")
        if self._unseen:
            return self._judged(f"{NOTHING}there was no {' and no '.join(self._unseen)}", at_s=at_s)
        if begin > self._last_s:
            return self._judged(f"{NOTHING}the run ended before {begin:g} s", at_s=at_s)
        margin = self._monitor.finish()
        assert margin is not None
        predicate = self._monitor.predicates[margin.predicate]
        unit = self._references[predicate.signal].unit
        reason = "" if margin.holds else _sentence(predicate.signal, margin, unit)
        return CheckResult(
            name=self.name,
            passed=margin.holds,
            value=None if isinstance(margin.value, str) else margin.value,
            limit=None if isinstance(predicate.limit, str) else predicate.limit,
            unit=unit,
            at_s=at_s,
            reason=reason,
            margin=margin.number,
            worst_s=margin.at_ns / 1e9,
        )


def _sentence(signal: str, margin: Margin, unit: str) -> str:
    value = f"{margin.value:.4g} {unit}".rstrip() if isinstance(margin.value, float) else repr(margin.value)
    return f"{signal} was {value} at {margin.at_ns / 1e9:.2f} s"


def _ns(seconds: float) -> int:
    return round(seconds * 1e9)


class AlwaysCheck(TemporalCheck):
    """Holds all the time."""

    Config = AlwaysConfig


class NeverCheck(TemporalCheck):
    """Holds at no time."""

    Config = NeverConfig


class EventuallyCheck(TemporalCheck):
    """Holds at some time."""

    Config = EventuallyConfig


class UntilCheck(TemporalCheck):
    """One holds until the other does."""

    Config = UntilConfig


class WithinCheck(TemporalCheck):
    """One follows the other soon."""

    Config = WithinConfig


class ReachesCheck(TemporalCheck):
    """The place was reached."""

    Config = ReachesConfig


class FormulaCheck(TemporalCheck):
    """The formula holds."""

    Config = FormulaConfig
