"""A check that is a formula over signals: it passes if the formula holds."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection
from typing import Any

from twin.errors import ScenarioError
from twin.scenario.checks.check import NOTHING, BaseMotion, Check, CheckResult, RobotCheckConfig
from twin.scenario.observation import CheckContext, Observation
from twin.scenario.quantities import in_degrees
from twin.scenario.signals import Signal
from twin.scenario.signals.reference import Reference
from twin.scenario.signals.topics import TopicReader
from twin.scenario.temporal import Formula, Margin, Monitor, Predicate
from twin.scenario.temporal.formula import Value, begins_ns

_AT_ONCE = 64
"""Observations and values that are judged in one go: one by one, between other work, that costs more."""


class SignalCheck(Check):
    """Judges a formula by a monitor, and gives it the signals that it is about."""

    _at_s: float | None = None
    _last_s: float | None = None

    def __init__(self, name: str, config: Any, context: CheckContext) -> None:
        super().__init__(name, config, context)
        self._formula = self.formula()
        self._monitor = Monitor(self._formula)
        self._signals: dict[str, Signal] = {}
        self.topics: dict[str, TopicReader] = {}
        self._unseen = dict.fromkeys(self._monitor.signals)
        self._waiting: list[Observation | tuple[str, int, Value]] = []
        """What is not judged yet, in order: observations, and values of topics with their signal and time."""
        for text in self._monitor.signals:
            reference = self.reference(text)
            if reference.field is None:
                self._signals[text] = reference.make(config.robot, context)
            else:
                self.topics[text] = reference.field.reader(context.topic_type(reference.field.topic))
        self.needs = frozenset(signal.needs for signal in self._signals.values()) - {""}
        for predicate in self._monitor.predicates:
            self._check_kind(predicate)

    @abstractmethod
    def formula(self) -> Formula:
        """Return what must hold."""

    def reference(self, signal: str) -> Reference:
        """Return what a name of a signal means."""
        return Reference(signal)

    def sentence(self, predicate: Predicate, margin: Margin) -> str:
        """Return why it failed, by the predicate whose value it was."""
        value, unit = margin.value, self._unit(predicate)
        if isinstance(value, float):
            value, unit = in_degrees(value, unit)  # as the table has it
            said = f"{round(value, 9) + 0.0:.4g} {unit}".rstrip()
        else:
            said = repr(value)
        return f"{predicate.signal} was {said} at {margin.at_ns / 1e9:.2f} s"

    def _unit(self, predicate: Predicate) -> str:
        signal = self._signals.get(predicate.signal)
        return "" if signal is None else signal.unit

    def nothing(self) -> str:
        """Return why there was nothing to look at, if the formula holds only for that; else nothing."""
        return ""

    def silence(self, signals: Collection[str]) -> str:
        """Return why it failed, if signals never had a value."""
        return f"{NOTHING}there was no {' and no '.join(signals)}"

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
        self._waiting.append((signal, time_ns, value))

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        self._waiting.append(observation)
        if len(self._waiting) >= _AT_ONCE:
            self._judge()

    def _judge(self) -> None:
        """Judge what waits."""
        waiting, self._waiting = self._waiting, []
        for each in waiting:
            if isinstance(each, Observation):
                self.look(each)
            else:
                self._give(*each)

    def look(self, observation: Observation) -> None:
        """Judge one observation, after all that came before it."""
        time_ns, monitor = observation.time_ns, self._monitor
        for text, signal in self._signals.items():
            value = signal.value(observation)
            if value is not None:
                self._give(text, time_ns, value)
        # What is published next may have this very time; of the truth there is no more of it.
        monitor.know(time_ns + (not self.topics))
        self._last_s = observation.time_s
        if self._at_s is None and monitor.verdict is not None:
            self._at_s = observation.time_s

    def _give(self, signal: str, time_ns: int, value: Value) -> None:
        self._unseen.pop(signal, None)
        self._monitor.take(signal, time_ns, value)

    @property
    def decided(self) -> bool | None:
        """Whether it holds, whatever comes; None: that is open."""
        self._judge()
        return self._monitor.verdict

    def result(self) -> CheckResult:
        """Return the outcome, the run being over; value, limit and unit are those of the worst moment."""
        self._judge()
        begin = begins_ns(self._formula) / 1e9
        at_s = self._last_s if self._at_s is None else self._at_s
        if self._last_s is None:
            return self._judged("the run made no step")
        if self._unseen:
            return self._judged(self.silence(self._unseen), at_s=at_s)
        if begin > self._last_s:
            return self._judged(f"{NOTHING}the run ended before {begin:g} s", at_s=at_s)
        margin = self._monitor.finish()
        assert margin is not None
        predicate = self._monitor.predicates[margin.predicate]
        nothing = self.nothing()
        return CheckResult(
            name=self.name,
            passed=margin.holds and not nothing,
            value=None if isinstance(margin.value, str) else margin.value,
            limit=None if isinstance(predicate.limit, str) else predicate.limit,
            unit=self._unit(predicate),
            at_s=at_s,
            reason=(nothing and NOTHING + nothing) if margin.holds else self.sentence(predicate, margin),
            margin=margin.number,
            worst_s=margin.at_ns / 1e9,
        )


class RobotSignalCheck(SignalCheck):
    """A check of its own name about one robot, which must have moved."""

    def __init__(self, name: str, config: RobotCheckConfig, context: CheckContext) -> None:
        self.robot = context.robot(config.robot)
        self._motion = BaseMotion()
        super().__init__(name, config, context)

    def look(self, observation: Observation) -> None:
        """Judge one observation, after all that came before it."""
        self._motion.take(observation.robots[self.robot].pose)
        super().look(observation)

    def nothing(self) -> str:
        """Return that the base stood."""
        return "" if self._motion.seen else f"{self.robot} did not move"
