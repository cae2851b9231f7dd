"""A run of a scenario with a mutant."""

from __future__ import annotations

import json
from contextlib import ExitStack
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

from twin.bridge.bus import Bus
from twin.errors import PluginError, ScenarioError, TwinError
from twin.experiments.mutants.mutant import Mutant, NotHere, Site
from twin.experiments.mutants.registry import MUTANTS
from twin.experiments.trials import Trial
from twin.files.kept import hash_of
from twin.plugins import execution
from twin.runtime.open_run import OpenRun
from twin.scenario.schema import load_again
from twin.scenario.source import Source
from twin.scenario.verdict import Verdict
from twin.sim.world import World

NOT_HERE = "not_here"
"""Key of the answer for a mutant that has nothing to spoil: what the scenario lacks."""
DECIDED = "decided"
"""Key of the answer for the names of the checks that ended the run; empty: it went on to its end."""
FAULT = "fault"
"""Key of the answer for a mutant that is wrong itself: what and where."""


@dataclass(frozen=True)
class MutantTrial(Trial):
    """A scenario to run with a mutant."""

    mutant: str = ""
    """Its name, `module:Class` or `FILE.py:Class`."""

    @property
    def key(self) -> str:
        """What the outcome depends on; of a user's mutant the file that it is in, too."""
        file = MUTANTS.find(self.mutant).place.file
        return json.dumps([super().key, self.mutant, file and hash_of(file)])

    def perform(self) -> dict[str, Any]:
        """Run until a check fails, and return the content of the verdict, or `NOT_HERE`, or `FAULT`."""
        decided: list[str] = []
        plugin = MUTANTS.find(self.mutant)
        try:
            with execution():
                verdict = self._run(plugin.create(), decided)
        except NotHere as fault:
            return {NOT_HERE: str(fault)}
        except PluginError as fault:
            if fault.problems[0].file == plugin.place.file:
                return {FAULT: str(fault)}
            verdict = self.broken(str(fault))
        except TwinError as fault:
            verdict = self.broken(str(fault))
        values: dict[str, Any] = json.loads(verdict.to_json())
        return values | {DECIDED: decided}

    def _run(self, mutant: Mutant, decided: list[str]) -> Verdict:
        data = deepcopy(dict(self.source.data))
        mutant.edit(data)
        data.setdefault("early_stop", "failed")  # one that holds to its end is the run that it was without
        try:
            scenario = load_again(Source(self.source.file, data), execute=True)
        except ScenarioError as fault:
            raise NotHere(f"the scenario cannot be changed so: {fault.problems[0].message}") from None
        with ExitStack() as ending:
            sites: list[Site] = []

            def install(world: World, bus: Bus) -> None:
                sites.append(Site(world, bus, ending))
                mutant.install(sites[0])

            run = OpenRun(scenario, record=False, before_nodes=install)
            ending.callback(run.close)
            sites[0].check()
            mutant.adjust(run.run)
            run.advance_to_end()
            decided += [check.name for check in run.run.checks if check.decided is False]
            return run.finish()
