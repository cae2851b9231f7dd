"""A scenario: one YAML file that says what to simulate and when it passes."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal

from pydantic import Field, PrivateAttr

from twin.errors import Problem, ScenarioError
from twin.models.sensors import SENSORS
from twin.parameters import NotNegative, Positive, Seconds
from twin.savings import uncollected
from twin.scenario import catalogue, consistency
from twin.scenario.cases import CasesConfig
from twin.scenario.checks import Check, CheckEntry
from twin.scenario.faults import FaultEntry
from twin.scenario.fields import RosName, faultless
from twin.scenario.missions import Idle, Mission
from twin.scenario.observation import CheckContext
from twin.scenario.pass_rate import PassRate
from twin.scenario.plugins import reference
from twin.scenario.robots import RobotConfig
from twin.scenario.source import NOWHERE, Source
from twin.scenario.world import PhysicsConfig, RecordingConfig, WorldConfig
from twin.strict_yaml import Document, StrictModel, checked, read


class Scenario(StrictModel):
    """What to simulate, and when it passes. Values are SI or carry a unit: `240`, `240 s`, `4 min`."""

    name: RosName
    """Name of the scenario; its runs are written to `runs/<name>/`."""
    description: str = ""
    """One sentence for people."""
    seed: Annotated[int, NotNegative] = 0
    """Seed of all noise."""
    duration: Annotated[Seconds, Positive]
    """Longest simulated time [s]; a run ends earlier when its mission is done."""
    physics: PhysicsConfig = PhysicsConfig()
    """Rates of the simulation."""
    world: WorldConfig = WorldConfig()
    """What surrounds the robots."""
    robots: Annotated[tuple[RobotConfig, ...], Field(min_length=1)]
    """The robots."""
    mission: Mission = Idle(type="idle")
    """What one of them is to do."""
    missions: tuple[Mission, ...] = ()
    """What several of them are to do, one each, instead of `mission`; over when all are."""
    faults: tuple[FaultEntry, ...] = ()
    """What goes wrong, and when."""
    sensors: tuple[Annotated[str, reference(SENSORS)], ...] = ()
    """Types of sensors of your own, beside those that ship: `FILE.py:Class` or `module:Class`."""
    checks: Annotated[tuple[CheckEntry, ...], Field(min_length=1)]
    """What must hold for the run to pass."""
    pass_rate: PassRate | None = None
    """What share of the runs of `twin sweep` is to pass; absent: all."""
    early_stop: Literal["never", "failed", "decided"] = "never"
    """When checks end the run: `failed`, as soon as one has failed whatever comes; `decided`, also when
    nothing that comes could change any of them."""
    recording: RecordingConfig = RecordingConfig()
    """What goes into the Rerun recording."""
    test: CasesConfig = CasesConfig()
    """With which seeds and values it is a test; `twin run` does not look at it."""

    _source: Source = PrivateAttr(NOWHERE)
    _parts_fit = faultless(consistency.faults)

    @property
    def source(self) -> Source:
        """What the file says, from which the scenario can be read again."""
        return self._source

    @property
    def tasks(self) -> tuple[Mission, ...]:
        """The missions, however many there are."""
        return self.missions or (self.mission,)

    def with_params_file(self, path: Path) -> Scenario:
        """Return the scenario with one Nav2 parameter file for every robot that navigates.

        Raises:
            ScenarioError: no robot does.
        """
        robots = tuple(
            robot
            if robot.navigation is None
            else robot.model_copy(
                update={"navigation": robot.navigation.model_copy(update={"params_file": str(path)})}
            )
            for robot in self.robots
        )
        if all(robot.navigation is None for robot in robots):
            raise ScenarioError(f"a parameter file is for navigation, and no robot of '{self.name}' has it")
        changed = self.model_copy(update={"robots": robots})
        navigates = [robot.navigation is not None for robot in robots]
        changed._source = self._source.with_params_file(str(path), navigates)
        return changed

    def build_checks(self, context: CheckContext) -> tuple[Check, ...]:
        """Return a fresh fold for each check.

        Raises:
            ScenarioError: The run lacks what some name, such as a zone or a topic.
        """
        checks, problems = [], list[Problem]()
        for i, entry in enumerate(self.checks):
            try:
                checks.append(entry.build(context))
            except ScenarioError as wrong:
                problems += [
                    problem if problem.file else self.source.problem(("checks", i), problem.message)
                    for problem in wrong.problems
                ]
        if problems:
            raise ScenarioError(problems)
        return tuple(checks)


def load(
    name_or_path: str | Path, overrides: Mapping[str, str] = MappingProxyType({}), *, execute: bool = False
) -> Scenario:
    """Read a scenario.

    Args:
        name_or_path: A name of `twin scenarios`, or a file.
        overrides: Dotted paths to YAML text: `{"robots.0.pose.x": "2 m"}`.
        execute: Whether the plugins that it names are executed, and their parameters checked by what they
            declare; without it they are found by reading.

    Raises:
        ScenarioError: With every problem of the file and of the overrides.
        PluginError: A plugin that was executed is wrong.
    """
    with uncollected():
        return of_document(read(catalogue.resolve(name_or_path), ScenarioError), overrides, execute)


def load_again(
    source: Source, overrides: Mapping[str, str] = MappingProxyType({}), *, execute: bool = False
) -> Scenario:
    """Return the scenario of what was read earlier; see `load`."""
    document = Document(source.file, deepcopy(source.data))
    return of_document(document, overrides, execute)


def of_document(
    document: Document, overrides: Mapping[str, str] = MappingProxyType({}), execute: bool = False
) -> Scenario:
    """Return the scenario of what was read; see `load`."""
    context = {"execute": execute}
    scenario = checked(document, Scenario, error=ScenarioError, overrides=overrides, context=context)
    scenario._source = Source(document.file.absolute(), document.data, document)
    return scenario


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of scenario files, for editors (`# yaml-language-server: $schema=...`)."""
    schema = Scenario.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
