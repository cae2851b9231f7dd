"""What a mobile manipulator can do, as leaves of a behaviour tree: drive, dock, look, reach, grasp, release.

Every leaf is an action or service of the robot's nodes, or a look at what its sensors publish.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

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
    PoseArray,
    PoseStamped,
    duration,
    header,
    new,
)
from twin.bridge.srvs import SetBool
from twin.geometry import Pose2
from twin.manipulation.telescopic_arm import GraspPose, TelescopicArm
from twin.manipulation.trajectory import plan_joint_move
from twin.navigation.behavior_trees.node import Status, TreeNode
from twin.navigation.docking.docks import DockType
from twin.nodes.messages import pose_stamped
from twin.nodes.missions.leaves import (
    CallAction,
    CallService,
    Condition,
    Do,
    MissionLeaf,
    sequence,
    while_true,
)
from twin.nodes.missions.mission_node import MissionNode
from twin.nodes.navigation.robot_pose import RobotPose
from twin.warehouse.shelf import Slot, Tote


@dataclass(frozen=True, kw_only=True)
class SkillsConfig:
    """How gently, and how sure, the robot handles goods."""

    docked_distance: float = -DockType.external_detection_translation_x
    """From the face to the base's origin when docked [m]."""
    staging_distance: float = -DockType.external_detection_translation_x - DockType.staging_x_offset
    """From the face to the base's origin before docking [m]."""
    gripper_effort: float = 80.0
    """That a finger presses with [N]."""
    least_grip: float = 0.5
    """Share of the effort with which the fingers closed; with less they hold nothing safely."""
    grip_tolerance: float = 0.012
    """Largest deviation of the finger from half the good's width for a grip [m]."""
    loaded_speed: float = 0.5
    """Fraction of the arm's speed while it carries something."""
    samples: int = 5
    """Detections of a tote before reaching; their median counts."""
    max_aside: float = 0.05
    """A tote further aside than this is not the one that the robot docked at [m]."""
    look_timeout_ns: int = 3_000_000_000
    """For these detections [ns]."""


class MobileManipulationNode(MissionNode):
    """`/mission` of a robot with navigation, docking, a telescopic arm and a gripper."""

    def __init__(
        self,
        bus: Bus,
        arm: TelescopicArm,
        *,
        gripper_joint: str,
        gripper_open: float,
        robot_pose: RobotPose,
        namespace: str = "",
    ) -> None:
        super().__init__(bus, namespace=namespace)
        self.skills = SkillsConfig()
        self._arm = arm
        self._gripper_joint = gripper_joint
        self._gripper_open = gripper_open
        self._robot_pose = robot_pose
        self._frames = robot_pose.frames
        self._totes: list[Pose2] = []
        self._joint_states = new(JointState)
        self._grip_effort = 0.0
        self.holds: Tote | None = None
        """What the fingers have closed on, and not lost."""
        self.gripped: set[str] = set()
        """Names of all that they have closed on."""
        self.is_docked = False
        """Whether the robot has docked, and not backed off since."""
        node = self.node
        self._navigate = ActionClient(node, NavigateToPose, "navigate_to_pose")
        self._dock = ActionClient(node, DockRobot, "dock_robot")
        self._undock = ActionClient(node, UndockRobot, "undock_robot")
        self._trajectory = ActionClient(node, FollowJointTrajectory, "arm_controller/follow_joint_trajectory")
        self._gripper = ActionClient(node, GripperCommand, "gripper_controller/gripper_cmd")
        self._detector = node.create_client(SetBool, "tote_detector/enable")
        node.create_subscription(JointState, "joint_states", self._on_joint_states, 1, frozen=True)
        node.create_subscription(PoseArray, "tote_poses", self._on_tote_poses, self.skills.samples)

    def _on_joint_states(self, message: JointState) -> None:
        self._joint_states = message

    def _measured(self, what: str) -> dict[str, float]:
        """Return the joints' `position` or `effort`; none if that is not measured."""
        state = self._joint_states
        return dict(zip(state.name, getattr(state, what).tolist(), strict=False))

    def _on_tote_poses(self, message: PoseArray) -> None:
        totes = [pose2_from_pose(pose) for pose in message.poses]
        self._totes += [tote for tote in totes if abs(tote.y) <= self.skills.max_aside][:1]
        del self._totes[: -self.skills.samples]

    def _call(
        self,
        name: str,
        client: ActionClient,
        goal: Callable[[], Any | None],
        judge: Callable[[Any], str | None] | None = None,
    ) -> TreeNode:
        return CallAction(name, client, goal, on_result=judge, on_failure=self.note)

    def _in_map(self, pose: Pose2) -> PoseStamped:
        return pose_stamped(pose, self._frames.map, self.node.now_ns)

    # Driving

    def report(self, state: str) -> TreeNode:
        """Go on to a state of the mission."""
        return Do(f"State[{state}]", lambda: self.enter(state))

    def drive_to(self, slot: Slot) -> TreeNode:
        """Navigate to the staging pose before a slot."""
        staging = slot.approach(0.0) @ Pose2(-self.skills.staging_distance, 0.0, 0.0)
        return self._call(
            f"NavigateTo[{slot.name}]",
            self._navigate,
            lambda: new(NavigateToPose.Goal, pose=self._in_map(staging)),
        )

    def dock_at(self, slot: Slot, dock_type: str) -> TreeNode:
        """Dock at a slot; `tote` centres the robot on the tote there, `table` on the plan's point."""
        docked = slot.approach(0.0) @ Pose2(-self.skills.docked_distance, 0.0, 0.0)

        def done(result: Any) -> None:
            self.is_docked = True

        return self._call(
            f"Dock[{slot.name}]",
            self._dock,
            lambda: new(
                DockRobot.Goal,
                use_dock_id=False,
                dock_pose=self._in_map(docked),
                dock_type=dock_type,
                navigate_to_staging_pose=False,
            ),
            done,
        )

    def undock_from(self, dock_type: str) -> TreeNode:
        """Back off to the staging distance."""
        goal = new(UndockRobot.Goal, dock_type=dock_type)

        def done(result: Any) -> None:
            self.is_docked = False

        return self._call("Undock", self._undock, lambda: goal, done)

    # Looking

    def detect(self, name: str, *, enabled: bool) -> TreeNode:
        """Switch the detection of totes on or off."""
        return CallService(name, self._detector, lambda: SetBool.Request(data=enabled))

    def look(self) -> TreeNode:
        """Wait for fresh detections of the tote ahead."""
        return _Look(self)

    # The arm

    def move_to_height(self, name: str, z: float, *, loaded: bool = False) -> TreeNode:
        """Bring the grasp frame to height z [m]."""
        config = self._arm.config
        return self.move(name, lambda: {config.lift_joint: z - config.grasp_z}, loaded=loaded)

    def raise_by(self, name: str, height: float) -> TreeNode:
        """Raise what the gripper holds, as far as the lift goes [m]."""
        joint = self._arm.config.lift_joint

        def target() -> dict[str, float]:
            return {joint: min(self._measured("position")[joint] + height, self._arm.limits[joint].upper)}

        return self.move(name, target, loaded=True)

    def retract(self, *, loaded: bool = False) -> TreeNode:
        """Bring the gripper back over the deck."""
        config = self._arm.config
        target = {config.extension_joint: 0.0, config.wrist_joint: 0.0}
        return self.move("Retract", lambda: target, loaded=loaded)

    def stow(self, z: float) -> TreeNode:
        """Retract the arm and bring the grasp frame to height z [m]."""
        config = self._arm.config
        target = {config.extension_joint: 0.0, config.wrist_joint: 0.0, config.lift_joint: z - config.grasp_z}
        return self.move("Stow", lambda: target)

    def reach(self, name: str, x: float, z: float, *, loaded: bool = False) -> TreeNode:
        """Bring the grasp frame to x, z [m] in the base frame, straight ahead."""
        return self.move(name, lambda: self._arm.inverse(GraspPose(x=x, z=z)), loaded=loaded)

    def reach_for_tote(self, z: float, depth: float) -> TreeNode:
        """Bring the grasp frame to the middle, `depth` / 2 [m] behind the face, of the tote that was seen."""

        def target() -> dict[str, float]:
            x, _, yaw = np.median(self._totes, axis=0)
            return self._arm.inverse(GraspPose(x=float(x) + depth / 2.0, z=z, yaw=float(yaw)))

        return self.move("ReachForTote", target)

    def move(self, name: str, target: Callable[[], dict[str, float]], *, loaded: bool = False) -> TreeNode:
        """Move joints to `target()`; fails, saying why, where a joint cannot."""

        def goal() -> Any | None:
            try:
                return self._trajectory_goal(target(), self.skills.loaded_speed if loaded else 1.0)
            except ValueError as error:
                self.note(str(error))
                return None

        return self._call(name, self._trajectory, goal)

    def _trajectory_goal(self, target: dict[str, float], speed: float) -> Any:
        trajectory = plan_joint_move(self._measured("position"), target, self._arm.limits, speed=speed)
        way = zip(trajectory.times, trajectory.positions, trajectory.velocities, strict=True)
        points = [
            new(
                JointTrajectoryPoint,
                positions=positions,
                velocities=velocities,
                time_from_start=duration(int(time * 1e9)),
            )
            for time, positions, velocities in way
        ]
        names = list(trajectory.joint_names)
        message = JointTrajectory(header=header(self.node.now_ns, ""), joint_names=names, points=points)
        return new(FollowJointTrajectory.Goal, trajectory=message)

    # The gripper

    def open_gripper(self) -> TreeNode:
        """Open the fingers fully."""

        def done(result: Any) -> None:
            self.holds = None

        return self._call("OpenGripper", self._gripper, lambda: self._gripper_goal(self._gripper_open), done)

    def close_on(self, tote: Tote) -> TreeNode:
        """Close the fingers; fails unless they stall on something of the tote's width."""
        width = tote.size[1]

        def judge(result: Any) -> str | None:
            self._grip_effort = result.effort
            if result.stalled and abs(result.position - width / 2.0) < self.skills.grip_tolerance:
                self.holds = tote
                self.gripped.add(tote.name)
                return None
            return f"gripper closed on nothing of {width:.2f} m width: finger at {result.position:.3f} m"

        return self._call("CloseGripper", self._gripper, lambda: self._gripper_goal(0.0), judge)

    def holding(self, tote: Tote, steps: Sequence[TreeNode]) -> TreeNode:
        """Take steps while the fingers are held apart by a tote, and press on it.

        That is watched at every tick: when it is lost, the step under way is cancelled, and the node fails.
        """
        what, width = tote.name, tote.size[1]

        def held() -> bool:
            fault = self._grip_fault(width)
            if fault is not None:
                pose = self._robot_pose.in_map()
                place = "" if pose is None else f", at ({pose.x:.2f}, {pose.y:.2f})"
                self.holds = None
                self.note(f"lost {what} at {self.node.now_ns * 1e-9:.1f} s{place}: {fault}")
            return fault is None

        return while_true(Condition(f"Holding[{what}]", held), sequence(f"With[{what}]", steps))

    def _grip_fault(self, width: float) -> str | None:
        """Return what the finger's encoder and drive tell against a grip, if anything."""
        finger = self._measured("position").get(self._gripper_joint, 0.0)
        effort = self._measured("effort").get(self._gripper_joint)
        if abs(finger - width / 2.0) > self.skills.grip_tolerance:
            return f"finger at {finger:.3f} m instead of {width / 2.0:.3f} m"
        if effort is not None and abs(effort) < self.skills.least_grip * self._grip_effort:
            return f"finger presses with {abs(effort):.0f} N instead of {self._grip_effort:.0f} N"
        return None

    def _gripper_goal(self, position: float) -> Any:
        command = new(GripperCommandMsg, position=position, max_effort=self.skills.gripper_effort)
        return new(GripperCommand.Goal, command=command)


class _Look(MissionLeaf):
    """Waits for detections made after it began."""

    def __init__(self, robot: MobileManipulationNode) -> None:
        super().__init__("Look")
        self._robot = robot

    def begin(self) -> None:
        """Forget what was seen on the way."""
        self._robot._totes.clear()
        self._deadline = self._robot.node.now_ns + self._robot.skills.look_timeout_ns

    def update(self) -> Status:
        """Count."""
        if len(self._robot._totes) >= self._robot.skills.samples:
            return Status.SUCCESS
        if self._robot.node.now_ns < self._deadline:
            return Status.RUNNING
        self._robot.note("no tote straight ahead")
        return Status.FAILURE
