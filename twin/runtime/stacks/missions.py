"""The mission of a scenario as nodes on the bus; what one mission alone needs is imported with it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from twin.bridge import types
from twin.bridge.action_types import (
    BackUp,
    DockRobot,
    DriveOnHeading,
    NavigateToPose,
    Spin,
    UndockRobot,
    Wait,
)
from twin.bridge.bus import Bus
from twin.bridge.msgs import Point, duration, new
from twin.bridge.types import ActionType
from twin.errors import ScenarioError, TaskError
from twin.geometry import Pose2
from twin.nodes.messages import pose_stamped
from twin.nodes.missions.mission_node import MissionNode
from twin.nodes.missions.simple import ActionSequenceNode, ActionStep, VelocityProfileNode
from twin.parameters.declaration import fields_of
from twin.runtime.stacks.robot import RobotStack
from twin.scenario import missions
from twin.scenario.missions import (
    MISSIONS,
    Behaviors,
    BehaviorStep,
    Explore,
    Idle,
    Mission,
    PickAndPlace,
    QueuedTask,
    R2D2StatePublisher,
    RandomGoals,
    Task,
    Tasks,
    UserMission,
    VelocityProfile,
)
from twin.strict_yaml import StrictModel

if TYPE_CHECKING:
    from twin.runtime.defaults.from_description import Manipulator
    from twin.warehouse.arena import Arena
    from twin.warehouse.pick_and_place import PickAndPlaceNode


class IdleMission:
    """Nothing to do; the run lasts its whole duration."""

    state = "idle"
    done = False
    succeeded: bool | None = None
    reason = ""


class Missions:
    """Those of several robots: over when all are, a success if all are."""

    def __init__(self, missions: Mapping[str, MissionNode]) -> None:
        self.of = missions
        """The mission of each robot."""

    @property
    def state(self) -> str:
        """What each is at: `a: goal 3; b: done`."""
        return "; ".join(f"{name}: {mission.state}" for name, mission in self.of.items())

    @property
    def done(self) -> bool:
        """Whether all are over."""
        return all(mission.done for mission in self.of.values())

    @property
    def succeeded(self) -> bool | None:
        """Whether all have succeeded; None while that is open."""
        ends = [mission.succeeded for mission in self.of.values()]
        return False if False in ends else None if None in ends else True

    @property
    def reason(self) -> str:
        """Why some have failed."""
        failed = [(name, m) for name, m in self.of.items() if m.done and not m.succeeded]
        return "; ".join(f"{name}: {mission.reason or mission.state}" for name, mission in failed)


AnyMission = MissionNode | IdleMission | Missions


@dataclass(frozen=True, kw_only=True)
class MissionContext:
    """What a mission is made with."""

    bus: Bus
    robot: RobotStack
    """Its nodes; `robot_pose` is where it believes to be, `frames` are the names of its frames."""
    namespace: str
    """Of the robot's nodes: '' for a single robot, '/name' among several."""
    arena: Arena | None
    seed: int
    control_period_ns: int


def build_missions(
    missions: Sequence[Mission], stacks: Mapping[str, RobotStack], arena: Arena | None
) -> AnyMission:
    """Return the scenario's missions, each a node on the bus."""
    tasks = [mission for mission in missions if not isinstance(mission, Idle)]
    built = {task.robot or next(iter(stacks)): _build(task, stacks, arena) for task in tasks}
    return Missions(built) if len(built) > 1 else next(iter(built.values()), IdleMission())


def _build(mission: Task, stacks: Mapping[str, RobotStack], arena: Arena | None) -> MissionNode:
    robot = stacks[mission.robot or next(iter(stacks))]
    context = MissionContext(
        bus=robot.context.bus,
        robot=robot,
        namespace=robot.context.namespace,
        arena=arena,
        seed=robot.context.seed,
        control_period_ns=robot.context.control_period_ns,
    )
    context.bus.group = context.namespace
    plugin = MISSIONS.find(mission.type)
    if not isinstance(mission, UserMission):
        shipped: MissionNode = plugin.create(context, mission)
        return shipped
    made: MissionNode = plugin.create(context, mission.use.config(plugin))
    if not hasattr(made, "done"):
        raise plugin.error("does not call super().__init__(context.bus, namespace=context.namespace)")
    return made


def behaviors(context: MissionContext, mission: Behaviors) -> MissionNode:
    """Return Nav2's behaviours, one after the other."""
    steps = [_behavior(step, context.robot) for step in mission.steps]
    return ActionSequenceNode(context.bus, steps * mission.repeat, namespace=context.namespace)


def random_goals(context: MissionContext, mission: RandomGoals) -> MissionNode:
    """Return a drive to random places."""
    from twin.nodes.missions.random_goals import RandomGoalsNode
    from twin.nodes.missions.random_goals_config import RandomGoalsConfig

    goals = RandomGoalsConfig(**{name: getattr(mission, name) for name in fields_of(RandomGoalsConfig)})
    pose = context.robot.robot_pose
    # Several robots do not all go to the same places.
    seed = (context.seed, *context.namespace.encode()) if context.namespace else context.seed
    return RandomGoalsNode(context.bus, pose, goals, seed=seed, namespace=context.namespace)


def velocity_profile(context: MissionContext, mission: VelocityProfile) -> MissionNode:
    """Return commands open loop."""
    return VelocityProfileNode(
        context.bus,
        [(step.duration, step.linear, step.angular) for step in mission.steps] * mission.repeat,
        control_period_ns=context.control_period_ns,
        namespace=context.namespace,
    )


def r2d2_state_publisher(context: MissionContext, mission: R2D2StatePublisher) -> MissionNode:
    """Return the tutorial's circle."""
    from twin.nodes.r2d2_state_publisher import R2D2StatePublisherNode

    stack = context.robot
    return R2D2StatePublisherNode(
        context.bus,
        radius=mission.radius,
        rate_hz=mission.rate,
        degrees_per_cycle=mission.degrees_per_cycle,
        joints=tuple(stack.handle.description.commands),
        move_base=lambda pose: stack.handle.set_kinematic_pose(stack.standing(pose)),
        frames=stack.frames,
        namespace=context.namespace,
    )


def _behavior(step: BehaviorStep, stack: RobotStack) -> ActionStep:
    """Return the action of one step of a behaviour mission."""
    action, label, goal = _goal(step.config, stack)
    if action is not NavigateToPose:
        return ActionStep(label, action, step.kind, lambda: goal)
    # A goal for a robot that nobody has localised yet is refused.
    return ActionStep(label, action, step.kind, lambda: goal, lambda: stack.robot_pose.in_map() is not None)


def _goal(step: StrictModel, stack: RobotStack) -> tuple[ActionType, str, Any]:
    """Return the action of a step, how it is called in the mission's state, and its goal message."""
    allowance = duration(120_000_000_000)
    match step:
        case missions.DriveOnHeading(distance=distance, speed=speed):
            target = Point(x=distance, y=0.0, z=0.0)
            goal = new(DriveOnHeading.Goal, target=target, speed=speed, time_allowance=allowance)
            return DriveOnHeading, f"drive {distance:g} m", goal
        case missions.BackUp(distance=distance, speed=speed):
            target = Point(x=distance, y=0.0, z=0.0)
            goal = new(BackUp.Goal, target=target, speed=speed, time_allowance=allowance)
            return BackUp, f"back up {distance:g} m", goal
        case missions.Spin(angle=angle):
            goal = new(Spin.Goal, target_yaw=angle, time_allowance=allowance)
            return Spin, f"spin {math.degrees(angle):.0f}°", goal
        case missions.Wait(duration=seconds):
            return Wait, f"wait {seconds:g} s", new(Wait.Goal, time=duration(round(seconds * 1e9)))
        case missions.NavigateToPose(x=x, y=y, yaw=yaw):
            pose = pose_stamped(Pose2(x, y, yaw), stack.frames.map, 0)
            return NavigateToPose, f"navigate to ({x:g}, {y:g})", new(NavigateToPose.Goal, pose=pose)
        case missions.DockRobot(dock=dock, max_staging_time=limit):
            goal = new(DockRobot.Goal, use_dock_id=True, dock_id=dock, max_staging_time=limit)
            return DockRobot, f"dock at {dock}", goal
        case missions.UndockRobot(dock_type=dock_type):
            return UndockRobot, "undock", new(UndockRobot.Goal, dock_type=dock_type)
    raise TypeError(type(step).__name__)


def explore(context: MissionContext, mission: Explore) -> MissionNode:
    """Return an explorer and who watches it."""
    from twin.navigation.costmaps import footprint as footprints
    from twin.navigation.exploration.config import ExplorerConfig, FrontierConfig
    from twin.nodes.missions.simple import ExploreMissionNode
    from twin.nodes.navigation.exploration.config import ExplorerNodeConfig
    from twin.nodes.navigation.exploration.explorer import ExplorerNode

    bus, stack, namespace = context.bus, context.robot, context.namespace
    inner, outer = footprints.radii(stack.footprint)
    frontiers = FrontierConfig(robot_radius=outer, inscribed_radius=inner)
    defaults = ExplorerNodeConfig(explorer=ExplorerConfig(frontiers=frontiers))
    node = ExplorerNode(bus, stack.robot_pose, mission.over(defaults), namespace=namespace)
    return ExploreMissionNode(bus, node, namespace=namespace)


def pick_and_place(context: MissionContext, mission: PickAndPlace) -> MissionNode:
    """Return the drive from tote to tote."""
    from twin.warehouse.pick_and_place import PickAndPlaceTask

    stack, arena = context.robot, context.arena
    assert arena is not None  # as the scenario's checks say
    if stack.manipulator is None or stack.navigator is None:
        lacks = "arm with a grasp_frame" if stack.manipulator is None else "navigation"
        raise ScenarioError(
            f"the mission pick_and_place needs a robot with an {lacks}; '{stack.name}' has none"
        )
    taken: dict[str, int] = {}
    tasks = []
    for task in mission.tasks:
        tote, zone = arena.tote(task.tote), arena.zone(task.to)
        index = taken.setdefault(task.to, 0)
        taken[task.to] += 1
        if index >= len(zone.slots):
            raise ScenarioError(
                f"zone '{task.to}' has room for {len(zone.slots)} totes; the mission brings it more"
            )
        tasks.append(PickAndPlaceTask(tote=tote, place=zone.slots[index]))
    node = _carrier(context, stack.manipulator)
    node.carry(tasks)
    return node


def _carrier(context: MissionContext, manipulator: Manipulator) -> PickAndPlaceNode:
    from twin.warehouse.pick_and_place import PickAndPlaceNode

    return PickAndPlaceNode(
        context.bus,
        manipulator.arm,
        gripper_joint=manipulator.gripper_joint,
        gripper_open=manipulator.gripper_open,
        robot_pose=context.robot.robot_pose,
        namespace=context.namespace,
    )


def tasks(context: MissionContext, mission: Tasks) -> MissionNode:
    """Return a queue of tasks: of those that are listed, and of those that others add."""
    from twin.navigation.costmaps import footprint as footprints
    from twin.nodes.missions.tasks.kinds import Dock, DriveTo, TaskKind, Undock, WaitFor
    from twin.nodes.missions.tasks.server import TaskServer

    stack, arena = context.robot, context.arena
    kinds: list[TaskKind] = []
    if arena is not None and stack.manipulator is not None:
        from twin.warehouse.carrying import Carry

        node: MissionNode = (carrier := _carrier(context, stack.manipulator))
        kinds.append(Carry(carrier, arena))
    else:
        node = MissionNode(context.bus, namespace=context.namespace)
    places = {} if arena is None else {name: zone.pose for name, zone in arena.zones.items()}
    places |= {} if arena is None else arena.poses
    inscribed, _ = footprints.radii(stack.footprint)
    kinds += [DriveTo(node, stack.robot_pose, places, inscribed), WaitFor(node)]
    navigation = stack.context.config.navigation
    docks = {} if navigation is None else navigation.docking.docks
    if docks:
        here = {name: dock.pose.pose for name, dock in docks.items() if dock.frame == stack.frames.map}
        kinds += [Dock(node, here), Undock(node)]
    server = TaskServer(node, kinds, stack.robot_pose, waits_for_more=mission.waits_for_more)
    for index, step in enumerate(mission.tasks):
        try:
            server.add(_task(step, stack))
        except TaskError as error:
            raise ScenarioError(f"task {index + 1} of robot '{stack.name}': {error}") from None
    return node


def _task(step: QueuedTask, stack: RobotStack) -> Any:
    """Return a task of a scenario as its message."""
    fields: dict[str, Any] = {}
    match step.config:
        case missions.DriveTo(place="", x=float(x), y=float(y), yaw=yaw):
            fields["pose"] = pose_stamped(Pose2(x, y, yaw), stack.frames.map, 0)
        case missions.DriveTo(place=place):
            fields["place"] = place
        case missions.PickAndPlaceTask(tote=tote, to=to):
            fields |= {"tote": tote, "to": to}
        case missions.DockAt(dock=dock):
            fields["dock"] = dock
        case missions.Wait(duration=seconds):
            fields["duration"] = duration(round(seconds * 1e9))
    return new(types.get("twin_msgs/msg/Task"), type=step.kind, **fields)
