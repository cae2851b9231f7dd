"""One robot of a scenario of several, as it is on a computer of its own."""

from __future__ import annotations

from copy import deepcopy

from twin.errors import ScenarioError, nearest
from twin.scenario.schema import Scenario, of_document
from twin.strict_yaml import Document


def one_robot(scenario: Scenario, name: str) -> Scenario:
    """Return the scenario without its other robots, their missions and faults, and without its checks.

    Raises:
        ScenarioError: It has no such robot, or something that stays asks for another one.
    """
    names = [robot.id for robot in scenario.robots]
    if name not in names:
        raise ScenarioError(f"'{scenario.name}' has no robot '{name}'; {nearest(name, names)}")
    source = scenario.source
    document = Document(source.file, deepcopy(source.data))
    data = document.data
    data["robots"] = [data["robots"][names.index(name)]]
    data["faults"] = [
        told
        for told, fault in zip(data.get("faults", ()), scenario.faults, strict=True)
        if fault.given.get("robot") in (None, name)
    ]
    key = "missions" if scenario.missions else "mission"
    told = data.get("missions", [data[key]] if key in data else [])
    mine = [
        each
        for each, task in zip(told, scenario.tasks, strict=False)
        if getattr(task, "robot", None) in (None, name)
    ]
    for each in ("missions", "mission"):
        data.pop(each, None)
    if mine:
        data["mission"] = mine[0]
    data["checks"] = [{"no_collision": None}]
    return of_document(document)
