"""In what a robot is otherwise than its model says: `wheel_radius=0.97,latency=80ms,clock_offset=0.4s`."""

from __future__ import annotations

from copy import deepcopy

from twin.errors import Problem, ScenarioError, nearest
from twin.live.device_clock import RIGHT, ClockError
from twin.scenario.faults import FAULTS
from twin.scenario.schema import Scenario, of_document
from twin.strict_yaml import Document, apply_override, checked


def perturbed(scenario: Scenario, text: str, option: str = "--perturb") -> tuple[Scenario, ClockError]:
    """Return a scenario with more faults, there from the start, and how wrong the robot's clock is.

    Args:
        scenario: Whose own faults stay.
        text: `KEY=VALUE,KEY=VALUE`: faults of which one number tells enough, and the fields of `ClockError`.
        option: Of the command line, for sentences.

    Raises:
        ScenarioError: With everything in `text` that is wrong.
    """
    kinds = [name for name in FAULTS.shipped if FAULTS.find(name).load().value]
    source = scenario.source
    document, clock = Document(source.file, deepcopy(source.data)), Document(source.file, {})
    faults = document.data.setdefault("faults", [])
    problems = []
    for word in filter(None, map(str.strip, text.split(","))):
        key, equals, value = word.partition("=")
        if not equals:
            problems.append(Problem(f"{option} {word}: must be KEY=VALUE, such as wheel_radius=0.97"))
        elif key in ClockError.model_fields:
            _put(clock, (key,), value, word)
        elif key in kinds:
            faults.append({})
            _put(document, ("faults", len(faults) - 1, key), value, word)
        else:
            known = nearest(key, [*kinds, *ClockError.model_fields])
            problems.append(Problem(f"{option} {word}: there is no '{key}'; {known}"))
    error, changed = RIGHT, scenario
    try:
        error = checked(clock, ClockError, error=ScenarioError)
    except ScenarioError as wrong:
        problems += wrong.problems
    try:
        changed = of_document(document)
    except ScenarioError as wrong:
        problems += wrong.problems
    if problems:
        raise ScenarioError(problems)
    return changed, error


def _put(document: Document, loc: tuple[str | int, ...], value: str, word: str) -> None:
    apply_override(document, ".".join(map(str, loc)), value)
    document.overrides[loc] = word
