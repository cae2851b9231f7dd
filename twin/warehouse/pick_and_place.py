"""The capstone's mission: fetch totes from shelves and set them down in the unloading zone.

One behaviour tree per task; its leaves are actions of the robot's nodes and looks at what its sensors say.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from twin.bridge.action_types import (
    DockRobot,
    FollowJointTrajectory,
    GripperCommand,
    NavigateToPose,
    UndockRobot,
)
from twin.bridge.actions import ActionClient
from twin.bridge.bus import Bus
from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import (
    GripperCommandMsg,
    JointState,
    JointTrajectory,
    JointTrajectoryPoint,
    PoseStamped,
    duration,
    header,
    new,
)
from twin.bridge.srvs import SetBool
from twin.geometry import Pose2
from twin.manipulation.telescopic_arm import GraspPose, TelescopicArm
from twin.manipulation.trajectory import plan_joint_move
from twin.nodes.bt.control import RecoveryNode, sequence
from twin.nodes.bt.leaves import CallAction, CallService, Condition, Do
from twin.nodes.messages import pose_stamped
from twin.nodes.mission_nodes import MissionNode
from twin.nodes.robot_pose import Frames


@dataclass(frozen=True, kw_only=True)
class Station:
    """A place to dock at: the front face of a shelf slot or of a table, as the warehouse's plan gives it."""

    name: str
    face: Pose2
    """Point on the front face in `map`; its x axis points into the shelf, as a docked robot looks."""
    surface_z: float
    """Height of the surface that goods stand on [m]."""


@dataclass(frozen=True, kw_only=True)
class PickAndPlaceTask:
    """One tote to carry."""

    tote: str
    tote_width: float
    """Between the fingers [m]."""
    tote_depth: float
    """Along the reach [m]."""
    tote_height: float
    """[m]"""
    pick: Station
    place: Station


@dataclass(frozen=True, kw_only=True)
class PickAndPlaceConfig:
    """Distances and tolerances of picking and placing."""

    staging_distance: float = 1.1
    """From the face to the base's origin before docking [m]."""
    detection_height: float = 0.09
    """Of the grasp frame above the surface while docking and looking for the tote [m]."""
    place_depth: float = 0.24
    """From the table's face to the tote's centre [m]."""
    place_distance: float = 0.55
    """From the base's origin to the table's face when docked [m]."""
    lift_off: float = 0.05
    """Raised above the surface before the arm moves with the tote [m]."""
    set_down_clearance: float = 0.002
    """Between tote and surface when the gripper opens [m]."""
    carry_z: float = 0.45
    """Height of the grasp frame while driving with a tote [m]."""
    gripper_effort: float = 160.0
    """[N]"""
    grip_tolerance: float = 0.012
    """Largest deviation of the finger from half the tote's width for a grip [m]."""
    loaded_speed: float = 0.5
    """Fraction of the arm's speed while it carries a tote."""
    pick_attempts: int = 3
    """Docking and grasping is tried this often."""
    tote_samples: int = 5
    """Detections that are averaged before reaching."""


@dataclass
class _Memory:
    """What the tree knows."""

    totes: list[tuple[int, Pose2]]
    """Recent detections: stamp [ns] and pose of the tote's centre in the base frame."""
    joints: dict[str, float]


class PickAndPlaceNode(MissionNode):
    """`/mission`: runs the tasks one after the other; publishes `mission/state`."""

    def __init__(
        self,
        bus: Bus,
        tasks: Sequence[PickAndPlaceTask],
        arm: TelescopicArm,
        *,
        gripper_joint: str,
        gripper_open: float,
        frames: Frames,
        config: PickAndPlaceConfig | None = None,
        period_ns: int = 100_000_000,
        namespace: str = "",
    ) -> None:
        super().__init__(bus, namespace=namespace)
        node = self.node
        self.config = config or PickAndPlaceConfig()
        self._arm = arm
        self._gripper_joint = gripper_joint
        self._gripper_open = gripper_open
        self._frames = frames
        self._memory = _Memory([], {})
        self._navigate = ActionClient(node, NavigateToPose, "navigate_to_pose")
        self._dock = ActionClient(node, DockRobot, "dock_robot")
        self._undock = ActionClient(node, UndockRobot, "undock_robot")
        self._trajectory = ActionClient(node, FollowJointTrajectory, "arm_controller/follow_joint_trajectory")
        self._detector = node.create_client(SetBool, "tote_detector/enable")
        self._gripper = ActionClient(node, GripperCommand, "gripper_controller/gripper_cmd")
        node.create_subscription(JointState, "joint_states", self._on_joint_states, 10)
        node.create_subscription(PoseStamped, "tote_pose", self._on_tote_pose, 10)
        self._tree = sequence("PickAndPlace", [self._task(task) for task in tasks])
        node.create_timer(period_ns, self._tick)

    def _tick(self) -> None:
        if self.done:
            return
        self._tree.tick_once()
        if self._tree.status == Status.RUNNING:
            return
        self.finish(self._tree.status == Status.SUCCESS)

    def _on_joint_states(self, message: JointState) -> None:
        self._memory.joints = dict(zip(message.name, message.position.tolist(), strict=True))

    def _on_tote_pose(self, message: PoseStamped) -> None:
        self._memory.totes.append((self.node.now_ns, pose2_from_pose(message.pose)))
        del self._memory.totes[: -self.config.tote_samples]

    # The tree

    def _task(self, task: PickAndPlaceTask) -> Behaviour:
        config = self.config
        attempt = RecoveryNode(
            "PickWithRetries",
            config.pick_attempts - 1,
            self._pick(task),
            sequence(
                "ReleaseAndBackOff",
                [self._open(), self._retract(), self._undock_from("shelf"), self._stow()],
            ),
        )
        return sequence(
            task.tote,
            [
                self._state(f"{task.tote}: drive to {task.pick.name}"),
                self._stow(),
                self._drive_to(task.pick),
                attempt,
                self._state(f"{task.tote}: back off"),
                self._undock_from("shelf"),
                self._move_to_height("LowerToCarry", config.carry_z, loaded=True),
                self._holding(task),
                self._state(f"{task.tote}: carry to {task.place.name}"),
                self._drive_to(task.place),
                self._holding(task),
                *self._place(task),
                self._stow(),
            ],
        )

    def _pick(self, task: PickAndPlaceTask) -> Behaviour:
        config = self.config
        surface = task.pick.surface_z
        grasp_z = surface + task.tote_height / 2.0
        return sequence(
            f"Pick{task.tote}",
            [
                self._state(f"{task.tote}: dock at {task.pick.name}"),
                self._open(),
                self._move_to_height("RaiseToLook", surface + config.detection_height),
                self._detect(True),
                self._dock_at(task.pick, "tote"),
                self._state(f"{task.tote}: look"),
                Do("ForgetTotes", self._forget_totes),
                _Wait(lambda: len(self._memory.totes) >= config.tote_samples, self._clock, 3_000_000_000),
                self._detect(False),
                self._state(f"{task.tote}: reach"),
                self._move("Reach", lambda: self._reach_for(grasp_z, task.tote_depth), on_failure=self.note),
                self._state(f"{task.tote}: grasp"),
                self._close(task),
                self._move_to_height("LiftOff", grasp_z + config.lift_off, loaded=True),
                self._holding(task),
                self._state(f"{task.tote}: retract"),
                self._retract(loaded=True),
                self._holding(task),
            ],
        )

    def _place(self, task: PickAndPlaceTask) -> list[Behaviour]:
        config = self.config
        set_down = task.place.surface_z + task.tote_height / 2.0 + config.set_down_clearance
        return [
            self._state(f"{task.tote}: dock at {task.place.name}"),
            self._dock_at(task.place, "table"),
            self._state(f"{task.tote}: set down"),
            self._move_to_height("RaiseToPlace", set_down + config.lift_off, loaded=True),
            self._move(
                "ReachToPlace",
                lambda: self._at(config.place_distance + config.place_depth, set_down + config.lift_off),
                loaded=True,
            ),
            self._holding(task),
            self._move_to_height("Lower", set_down, loaded=True),
            self._state(f"{task.tote}: release"),
            self._open(),
            self._state(f"{task.tote}: back off"),
            self._retract(),
            self._undock_from("table"),
        ]

    # Leaves

    def _state(self, state: str) -> Behaviour:
        return Do(f"State[{state}]", lambda: self.enter(state))

    def _clock(self) -> int:
        return self.node.now_ns

    def _drive_to(self, station: Station) -> Behaviour:
        staging = station.face @ Pose2(-self.config.staging_distance, 0.0, 0.0)
        return CallAction(
            f"NavigateTo[{station.name}]",
            self._navigate,
            lambda: new(NavigateToPose.Goal, pose=pose_stamped(staging, self._frames.map, self.node.now_ns)),
            on_failure=self.note,
        )

    def _dock_at(self, station: Station, dock_type: str) -> Behaviour:
        return CallAction(
            f"Dock[{station.name}]",
            self._dock,
            lambda: new(
                DockRobot.Goal,
                use_dock_id=False,
                dock_pose=pose_stamped(station.face, self._frames.map, self.node.now_ns),
                dock_type=dock_type,
                navigate_to_staging_pose=False,
            ),
            on_failure=self.note,
        )

    def _undock_from(self, dock_type: str) -> Behaviour:
        return CallAction(
            "Undock",
            self._undock,
            lambda: new(UndockRobot.Goal, dock_type=dock_type),
            on_failure=self.note,
        )

    def _detect(self, enabled: bool) -> Behaviour:
        name = "LookForTotes" if enabled else "StopLooking"
        return CallService(name, self._detector, lambda: SetBool.Request(data=enabled))

    def _open(self) -> Behaviour:
        return CallAction("OpenGripper", self._gripper, lambda: self._gripper_goal(self._gripper_open))

    def _close(self, task: PickAndPlaceTask) -> Behaviour:
        def judge(result: Any) -> str | None:
            if result.stalled and abs(result.position - task.tote_width / 2.0) < self.config.grip_tolerance:
                return None
            finger = f"finger at {result.position:.3f} m"
            return f"gripper closed on nothing of {task.tote_width:.2f} m width: {finger}"

        return CallAction(
            "CloseGripper",
            self._gripper,
            lambda: self._gripper_goal(0.0),
            on_result=judge,
            on_failure=self.note,
        )

    def _gripper_goal(self, position: float) -> Any:
        command = new(GripperCommandMsg, position=position, max_effort=self.config.gripper_effort)
        return new(GripperCommand.Goal, command=command)

    def _holding(self, task: PickAndPlaceTask) -> Behaviour:
        def held() -> bool:
            finger = self._memory.joints.get(self._gripper_joint, 0.0)
            if abs(finger - task.tote_width / 2.0) < self.config.grip_tolerance:
                return True
            self.note(f"lost {task.tote}: finger at {finger:.3f} m instead of {task.tote_width / 2.0:.3f} m")
            return False

        return Condition("HoldsTote", held)

    def _move_to_height(self, name: str, z: float, *, loaded: bool = False) -> Behaviour:
        lift = self._arm.config.lift_joint
        return self._move(
            name, lambda: {lift: z - self._arm.config.grasp_z}, loaded=loaded, on_failure=self.note
        )

    def _retract(self, *, loaded: bool = False) -> Behaviour:
        config = self._arm.config
        return self._move(
            "Retract", lambda: {config.extension_joint: 0.0, config.wrist_joint: 0.0}, loaded=loaded
        )

    def _stow(self) -> Behaviour:
        return self._move(
            "Stow",
            lambda: {
                **self._arm.inverse(GraspPose(x=self._retracted_x(), z=self.config.carry_z)),
            },
        )

    def _retracted_x(self) -> float:
        return self._arm.config.wrist_x + self._arm.config.grasp_length

    def _at(self, x: float, z: float) -> dict[str, float]:
        return self._arm.inverse(GraspPose(x=x, z=z))

    def _reach_for(self, z: float, depth: float) -> dict[str, float]:
        poses = np.array([pose for _, pose in self._memory.totes])
        x, _, yaw = poses.mean(axis=0)
        return self._arm.inverse(GraspPose(x=float(x) + depth / 2.0, z=z, yaw=float(yaw)))

    def _move(
        self,
        name: str,
        target: Callable[[], dict[str, float]],
        *,
        loaded: bool = False,
        on_failure: Callable[[str], None] | None = None,
    ) -> Behaviour:
        def goal() -> Any | None:
            try:
                return self._trajectory_goal(target(), self.config.loaded_speed if loaded else 1.0)
            except ValueError as error:
                self.note(str(error))
                return None

        return CallAction(name, self._trajectory, goal, on_failure=on_failure or self.note)

    def _trajectory_goal(self, target: dict[str, float], speed: float) -> Any:
        trajectory = plan_joint_move(self._memory.joints, target, self._arm.limits, speed=speed)
        points = [
            new(
                JointTrajectoryPoint,
                positions=positions,
                velocities=velocities,
                time_from_start=duration(int(time * 1e9)),
            )
            for time, positions, velocities in zip(
                trajectory.times, trajectory.positions, trajectory.velocities, strict=True
            )
        ]
        message = JointTrajectory(
            header=header(self.node.now_ns, ""), joint_names=list(trajectory.joint_names), points=points
        )
        return new(FollowJointTrajectory.Goal, trajectory=message)

    def _forget_totes(self) -> None:
        self._memory.totes.clear()


class _Wait(Behaviour):
    """Waits until `ready`, at most `timeout_ns` of simulated time."""

    def __init__(self, ready: Callable[[], bool], clock: Callable[[], int], timeout_ns: int) -> None:
        super().__init__("WaitForTote")
        self._ready = ready
        self._clock = clock
        self._timeout_ns = timeout_ns

    def initialise(self) -> None:
        """Start the time."""
        self._deadline = self._clock() + self._timeout_ns

    def update(self) -> Status:
        """Look."""
        if self._ready():
            return Status.SUCCESS
        return Status.RUNNING if self._clock() < self._deadline else Status.FAILURE
