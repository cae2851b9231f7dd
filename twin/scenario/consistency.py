"""Faults between the parts of a scenario that are each valid on their own."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from twin.errors import nearest
from twin.periods import period_of
from twin.scenario.checks.check import RobotCheckConfig
from twin.scenario.faults import titles
from twin.scenario.localisation import AmclLocalisation, SlamLocalisation
from twin.scenario.missions import (
    Behaviors,
    Explore,
    Idle,
    PickAndPlace,
    R2D2StatePublisher,
    RandomGoals,
    Tasks,
)
from twin.strict_yaml import Fault, Loc

if TYPE_CHECKING:
    from twin.scenario.checks import CheckEntry
    from twin.scenario.missions import Mission, Task
    from twin.scenario.robots import RobotConfig
    from twin.scenario.schema import Scenario


def faults(scenario: Scenario) -> Iterator[Fault]:
    """Yield everything that does not fit together."""
    yield from _names(scenario)
    yield from _periods(scenario)
    yield from _arena(scenario)
    yield from _missions(scenario)
    yield from _faults(scenario)
    yield from _checks(scenario)


def nanoseconds(seconds: float) -> int:
    """Return a time in whole nanoseconds."""
    return round(seconds * 1e9)


def _names(scenario: Scenario) -> Iterator[Fault]:
    groups: tuple[tuple[Loc, list[str]], ...] = (
        (("robots",), [robot.id for robot in scenario.robots]),
        (("world", "obstacles"), [obstacle.name for obstacle in scenario.world.obstacles]),
        (("world", "goods"), [good.name for good in scenario.world.goods]),
    )
    for loc, names in groups:
        for i, name in enumerate(names):
            if name in names[:i]:
                first = ".".join(map(str, (*loc, names.index(name))))
                yield Fault((*loc, i, "name"), f"the name '{name}' is taken by {first}; names must differ")


def _periods(scenario: Scenario) -> Iterator[Fault]:
    timestep, control = scenario.physics.timestep, scenario.physics.control_period
    if not nanoseconds(control) or nanoseconds(control) % nanoseconds(timestep):
        text = f"the control period {_whole(control, 'physics steps', timestep)}"
        yield Fault(("physics", "control_period"), text)
        return
    rates: list[tuple[Loc, str, float]] = []
    poses_hz = scenario.recording.poses_hz
    if scenario.recording.enabled:
        rates.append((("recording", "poses_hz"), "the rate of the recorded poses", poses_hz))
    for at, mission in _tasks(scenario):
        if isinstance(mission, R2D2StatePublisher):
            rates.append(((*at, "rate"), "the rate of the publisher", mission.rate))
    for loc, what, rate in rates:
        if period_of(rate) < nanoseconds(control):
            most = f"at most {1.0 / control:.6g} Hz, one per control period ({control * 1e3:g} ms)"
            yield Fault(loc, f"{what} ({rate:g} Hz) must be {most}")
    for i, robot in enumerate(scenario.robots):
        if nanoseconds(robot.command_latency) % nanoseconds(control):
            whole = _whole(robot.command_latency, "control periods", control)
            yield Fault(("robots", i, "command_latency"), f"the latency of commands {whole}")


def _whole(period: float, units: str, unit: float) -> str:
    return f"({period * 1e3:g} ms) must be a whole number of {units} ({unit * 1e3:g} ms)"


def _arena(scenario: Scenario) -> Iterator[Fault]:
    if scenario.world.arena is not None:
        return
    message = "needs an arena; name one as world.arena"
    for i, robot in enumerate(scenario.robots):
        localisation = robot.localisation
        if robot.start is not None:
            yield Fault(("robots", i, "start"), f"the start '{robot.start}' {message}")
        if isinstance(localisation, AmclLocalisation) and localisation.map is None:
            yield Fault(("robots", i, "localisation"), f"amcl without a map {message}, or a map")
    for i, good in enumerate(scenario.world.goods):
        yield Fault(("world", "goods", i), f"the good '{good.name}' {message}")
    for at, mission in _tasks(scenario):
        if isinstance(mission, PickAndPlace):
            yield Fault(at, f"pick_and_place {message}")
    for i, entry in enumerate(scenario.checks):
        if entry.kind == "delivered":
            yield Fault(("checks", i), f"delivered {message}")
    for i, fault in enumerate(scenario.faults):
        if fault.kind == "displacement":
            yield Fault(("faults", i), f"displacement {message}")


def _tasks(scenario: Scenario) -> Iterator[tuple[Loc, Mission]]:
    """Yield each mission, and where it stands."""
    for i, mission in enumerate(scenario.tasks):
        yield ("missions", i) if scenario.missions else ("mission",), mission


def _missions(scenario: Scenario) -> Iterator[Fault]:
    if scenario.missions and not isinstance(scenario.mission, Idle):
        yield Fault(("missions",), "give the robots either a mission or a list of missions, not both")
    busy: set[str] = set()
    for loc, mission in _tasks(scenario):
        if isinstance(mission, Idle):
            continue
        yield from _mission(scenario, mission, loc)
        if mission.robot in busy:
            yield Fault(loc, f"robot '{mission.robot}' has a mission already; valid is one for each robot")
        busy.add(mission.robot or "")


def _mission(scenario: Scenario, mission: Task, loc: Loc) -> Iterator[Fault]:
    robots = [robot.id for robot in scenario.robots]
    yield from _robot(mission.robot, robots, loc, "the mission")
    if mission.robot not in robots:
        return
    index = robots.index(mission.robot)
    at, robot = ("robots", index), scenario.robots[index]
    if isinstance(mission, R2D2StatePublisher) and robot.base != "kinematic":
        yield Fault((*at, "base"), "the mission r2d2_state_publisher needs the base 'kinematic'")
    maps = isinstance(robot.localisation, SlamLocalisation)
    if isinstance(mission, Explore) and not (maps and robot.navigation is not None):
        needs = f"needs a navigation of robot '{robot.id}' and its localisation of type slam"
        yield Fault(at, f"the mission explore {needs}")
    if isinstance(mission, PickAndPlace | RandomGoals | Tasks) and robot.navigation is None:
        yield Fault(at, f"the mission {mission.type} needs a navigation of robot '{robot.id}'")
    if isinstance(mission, RandomGoals) and not isinstance(robot.localisation, AmclLocalisation):
        yield Fault(at, f"the mission random_goals needs a robot on a map: localisation amcl of '{robot.id}'")
    if isinstance(mission, Behaviors):
        yield from _behaviors(mission, robot, loc)


def _robot(name: str | None, robots: list[str], loc: Loc, what: str) -> Iterator[Fault]:
    """Yield why a name does not mean a robot; without one it is the only one."""
    if name is None and len(robots) > 1:
        yield Fault(loc, f"{what} must name its robot, there are several; valid: {', '.join(robots)}")
    elif name is not None and name not in robots:
        yield Fault((*loc, "robot"), f"unknown robot '{name}'; {nearest(name, robots)}")


def _behaviors(mission: Behaviors, robot: RobotConfig, loc: Loc) -> Iterator[Fault]:
    docks = robot.navigation.docking.docks if robot.navigation is not None else {}
    for i, step in enumerate(mission.steps):
        at = (*loc, "steps", i)
        if robot.navigation is None and step.kind in ("navigate_to_pose", "dock_robot", "undock_robot"):
            yield Fault(at, f"{step.kind} needs a navigation of robot '{robot.id}'")
        elif step.dock_robot is not None and step.dock_robot.dock not in docks:
            name = step.dock_robot.dock
            valid = nearest(name, docks) if docks else "navigation.docking.docks is empty"
            yield Fault((*at, "dock_robot", "dock"), f"robot '{robot.id}' knows no dock '{name}'; {valid}")


def _faults(scenario: Scenario) -> Iterator[Fault]:
    robots = [robot.id for robot in scenario.robots]
    names, labels = titles(scenario.faults), [entry.given.get("label") for entry in scenario.faults]
    for i, entry in enumerate(scenario.faults):
        given, loc = entry.given, ("faults", i, entry.kind)
        if given.get("robot") is not None or entry.needs_robot:
            yield from _robot(given.get("robot"), robots, loc, entry.kind)
        label = labels[i]
        if label is not None and label in labels[:i]:
            yield Fault((*loc, "label"), f"another fault is called '{label}'; labels must differ")
        at, when = given.get("at"), given.get("when")
        if at is not None and when is not None:
            yield Fault((*loc, "when"), "a fault begins either at a time or when something happens, not both")
        elif given.get("after") and when is None:
            yield Fault((*loc, "after"), "'after' needs a 'when'; without it, 'at' says the time")
        if isinstance(at, float) and at >= scenario.duration:
            yield Fault((*loc, "at"), f"the run ends after {scenario.duration:g} s, before {at:g} s")
        other = getattr(when, "fault", None)
        others = [*names[:i], *names[i + 1 :], *(e.kind for e in scenario.faults if e is not entry)]
        if other is not None and other not in others:
            valid = nearest(other, others) if others else "there is no other"
            yield Fault((*loc, "when", "fault"), f"there is no other fault '{other}'; {valid}")


def _checks(scenario: Scenario) -> Iterator[Fault]:
    robots = [robot.id for robot in scenario.robots]
    by_name = {robot.id: robot for robot in scenario.robots}
    carriers = [mission for mission in scenario.tasks if isinstance(mission, PickAndPlace)]
    totes = [task.tote for mission in carriers for task in mission.tasks]
    queues = [mission for mission in scenario.tasks if isinstance(mission, Tasks)]
    totes += [task.carry.tote for queue in queues for task in queue.tasks if task.carry is not None]
    idle = all(isinstance(mission, Idle) for mission in scenario.tasks)
    for i, entry in enumerate(scenario.checks):
        loc, subjects = ("checks", i, entry.kind), entry.subjects()
        robot = subjects.get("robot")
        if robot is not None or isinstance(entry.config, RobotCheckConfig):
            yield from _robot(robot, robots, loc, entry.kind)
        subject = by_name.get(robots[0] if robot is None and len(robots) == 1 else robot or "")
        if subject is not None and "robot" in subjects:
            yield from _lacking(entry, subject, loc)
        if idle and entry.kind in ("mission_succeeded", "mission_failed", "time_limit"):
            yield Fault(loc, f"{entry.kind} needs a mission that ends, not 'idle'")
        tote = subjects.get("tote")
        if entry.kind == "tote_slip" and tote is not None and tote not in totes:
            yield Fault((*loc, "tote"), f"the mission carries no tote '{tote}'; {nearest(tote, totes)}")


def _lacking(entry: CheckEntry, robot: RobotConfig, loc: Loc) -> Iterator[Fault]:
    """Yield what a robot has not got that a check is about."""
    if entry.kind == "recoveries" and robot.navigation is None:
        yield Fault(loc, f"recoveries needs a navigation of robot '{robot.id}'")
    maps = isinstance(robot.localisation, SlamLocalisation)
    if entry.kind in ("map_accuracy", "map_coverage") and not maps:
        yield Fault(loc, f"{entry.kind} needs the localisation of robot '{robot.id}' of type slam")
