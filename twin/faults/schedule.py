"""When faults begin and end, and what came of each."""

from __future__ import annotations

from dataclasses import replace

from twin.errors import Problem, ScenarioError
from twin.faults.fault import Effect, Fault, FaultContext
from twin.faults.triggers import Waiting, waiting
from twin.plugins import Plugin
from twin.scenario.faults import FaultConfig, FaultEntry, FaultReport, streams, titles
from twin.scenario.schema import Scenario
from twin.strict_yaml import Faults


class _Watched:
    """A fault, and where it is in its life."""

    def __init__(self, fault: Fault, plugin: Plugin[Fault], wait: Waiting | None) -> None:
        self.fault, self.kind, self.wait = fault, plugin.name, wait
        self._plugin, self.guard = plugin, plugin.guard
        config = fault.config
        lasts = getattr(config, "duration", None)
        self._after_ns = round(config.after * 1e9)
        self._lasts_ns = None if lasts is None else round(lasts * 1e9)
        self.due_ns: int | None = round((config.at or 0.0) * 1e9) if wait is None else None
        """When it is to begin; None while it waits."""
        self.begun_ns: int | None = None
        self.ended_ns: int | None = None

    @property
    def is_active(self) -> bool:
        return self.begun_ns is not None and self.ended_ns is None

    def is_due(self, now_ns: int) -> bool:
        if self.begun_ns is not None:
            return False
        if self.due_ns is None and self.wait is not None and self.wait():
            self.due_ns = now_ns + self._after_ns
        return self.due_ns is not None and self.due_ns <= now_ns

    def is_over(self, now_ns: int) -> bool:
        return (
            self._lasts_ns is not None and self.due_ns is not None and self.due_ns + self._lasts_ns <= now_ns
        )

    def report(self) -> FaultReport:
        if self.begun_ns is None:
            return FaultReport(name=self.fault.name, kind=self.kind, outcome="not_reached")
        with self.guard:
            effect = self.fault.effect
        if not isinstance(effect, Effect):
            raise self._plugin.error(f"tells {type(effect).__name__} as its effect; it must be an Effect")
        return FaultReport(
            name=self.fault.name,
            kind=self.kind,
            outcome="landed" if effect.is_seen else "no_effect",
            at_s=self.begun_ns / 1e9,
            end_s=None if self.ended_ns is None else self.ended_ns / 1e9,
            effect=effect.text,
        )


class FaultSchedule:
    """Lets faults happen when it is their time, and tells them in the log of `/faults`."""

    def __init__(self, scenario: Scenario, context: FaultContext) -> None:
        """Prepare them.

        Raises:
            ScenarioError: The run lacks what is to fail; all such faults, each with its line.
        """
        self._world, self._context = context.world, context
        self._begun: set[str] = set()
        self._watched: list[_Watched] = []
        self.extend(scenario)
        # Robots that pass for hardware do not know what is wrong with them.
        tells = context.bus.clock.is_simulated and any(watched.fault.text for watched in self._watched)
        self._logger = context.bus.create_node("faults").get_logger() if tells else None

    def extend(self, scenario: Scenario) -> None:
        """Prepare those of a scenario that come behind the ones that there are.

        Raises:
            ScenarioError: As from the constructor.
        """
        context = replace(self._context, streams=streams(scenario.faults))
        problems: list[Problem] = []
        named = list(enumerate(zip(scenario.faults, titles(scenario.faults), strict=True)))
        for i, (entry, name) in named[len(self._watched) :]:
            try:
                self._watched.append(self._prepared(entry, name, context))
            except Faults as wrong:
                loc = ("faults", i, entry.kind)
                problems += [
                    scenario.source.problem((*loc, *fault.loc), fault.message) for fault in wrong.faults
                ]
        if problems:
            raise ScenarioError(problems)
        self.robots = frozenset[str]().union(*(watched.fault.robots for watched in self._watched))
        """Robots that run in the process of the physics."""

    def update(self) -> None:
        """Let begin and end what is due at the world's time, and look at what came of the rest."""
        now_ns = self._world.time_ns
        for watched in self._watched:
            if watched.is_active:
                with watched.guard:
                    watched.fault.update()
                if watched.is_over(now_ns):
                    with watched.guard:
                        watched.fault.end()
                    watched.ended_ns = now_ns
                    self._tell(watched.fault.end_text or f"{watched.fault.text} is over")
        for watched in self._watched:
            if watched.is_due(now_ns):
                watched.begun_ns = now_ns
                self._begun |= {watched.fault.name, watched.kind}
                with watched.guard:
                    watched.fault.begin()
                self._tell(watched.fault.text)

    def reports(self) -> tuple[FaultReport, ...]:
        """Return what became of each, in the order of the scenario."""
        return tuple(watched.report() for watched in self._watched)

    def _prepared(self, entry: FaultEntry, name: str, context: FaultContext) -> _Watched:
        plugin, config = entry.resolved()
        if not isinstance(config, FaultConfig):
            raise plugin.error("has no Config that derives from twin.faults.FaultConfig")
        fault: Fault = plugin.create(name, config, context)
        if not hasattr(fault, "context"):
            raise plugin.error("does not call super().__init__(name, config, context)")
        wait = None
        if config.when is not None:
            wait = waiting(config.when, getattr(config, "robot", None), context, self._begun)
        return _Watched(fault, plugin, wait)

    def _tell(self, text: str) -> None:
        if self._logger is not None and text:
            self._logger.warn(text)
