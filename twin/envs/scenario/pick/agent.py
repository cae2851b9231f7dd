"""An agent that picks a tote: wheels, lift, arm and gripper, by what the palm's lidar sees."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces

from twin.bridge.action_types import GripperCommand
from twin.bridge.actions import ActionClient
from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import (
    GripperCommandMsg,
    JointTrajectory,
    JointTrajectoryPoint,
    Twist,
    duration,
    header,
    new,
)
from twin.bridge.srvs import SetBool
from twin.envs.scenario.agents.agent import Agent, Values, unit_box
from twin.envs.scenario.episode import Episode
from twin.envs.scenario.pick.mission import HoldTote
from twin.geometry import Pose2
from twin.scenario.fields import PoseConfig
from twin.scenario.schema import Scenario
from twin.warehouse import arena as arenas
from twin.warehouse.skills import SkillsConfig

SPEEDS = (0.3, 0.6, 0.3, 0.3)
"""Largest rates: forward [m/s], turn [rad/s], lift [m/s], reach of the arm [m/s]."""
_AHEAD = 0.15
"""So far, at most, a joint is sent from where it is [m]."""


class Pick(Agent):
    """Drives the last metre and grasps.

    An action is (forward, turn, lift, reach, gripper), each from -1 to 1: parts of the largest rates, and
    for the gripper closed if positive, else open. The detector of totes is on all the time; it sees what is
    in front of the palm, at the palm's height.
    """

    @dataclass(frozen=True, kw_only=True)
    class Config:
        """Where the robot starts, drawn from the seed of the run."""

        distance: tuple[float, float] = (1.1, 1.4)
        """Between the shelf's edge and the base's origin: least and largest [m]."""
        aside: float = 0.1
        """Largest offset to either side [m]."""
        yaw: float = 0.1
        """Largest turn to either side [rad]."""

    observes: ClassVar[tuple[str, ...]] = ("tote_poses", "odom")
    rewards: ClassVar[Mapping[str, float]] = {
        "approach": 1.0,
        "lift": 10.0,
        "mission": 10.0,
        "collision": 0.5,
        "time": 0.1,
    }

    def __init__(self, episode: Episode, config: Config) -> None:
        super().__init__(episode, config)
        self.action_space = unit_box(5)
        node, stack, mission = episode.node, episode.stack, episode.parts.mission
        assert stack.manipulator is not None  # the scenario is the one beside
        assert isinstance(mission, HoldTote)
        self._arm, self._finger = stack.manipulator.arm, stack.manipulator.gripper_joint
        self._open, self._tote = stack.manipulator.gripper_open, mission.tote
        self._joints = (self._arm.config.lift_joint, self._arm.config.extension_joint)
        self._velocity = node.create_publisher(Twist, "cmd_vel")
        self._trajectory = node.create_publisher(JointTrajectory, "arm_controller/joint_trajectory")
        self._gripper = ActionClient(node, GripperCommand, "gripper_controller/gripper_cmd")
        self._told: bool | None = None
        self._targets: dict[str, float] = {}
        self._states = episode.hear("joint_states")
        node.create_client(SetBool, "tote_detector/enable").call_async(SetBool.Request(data=True))

    @classmethod
    def prepared(cls, scenario: Scenario, config: Config) -> Scenario:
        """Return the scenario with the robot somewhere before the tote."""
        assert scenario.world.arena is not None
        random = np.random.Generator(np.random.Philox(scenario.seed))
        distance = random.uniform(*config.distance)
        aside, yaw = random.uniform(-config.aside, config.aside), random.uniform(-config.yaw, config.yaw)
        named = (scenario.mission.model_extra or {})["tote"]
        tote = arenas.load(scenario.world.arena).tote(named)
        start = tote.approach(distance) @ Pose2(0.0, aside, yaw)
        robot = scenario.robots[0].model_copy(
            update={"pose": PoseConfig(x=start.x, y=start.y, yaw=start.yaw)}
        )
        return scenario.model_copy(update={"robots": (robot,)})

    def asks(self) -> bool:
        """Return whether the joints' states are known: from the first message on."""
        return self._states.message is not None

    def act(self, action: Values) -> None:
        """Drive, move and grasp."""
        forward, turn, lift, reach, gripper = action.tolist()
        self._velocity.publish(twist_from_planar(SPEEDS[0] * forward, SPEEDS[1] * turn), frozen=True)
        self._move((SPEEDS[2] * lift, SPEEDS[3] * reach / self._arm.config.extension_ratio))
        if (closed := gripper > 0.0) != self._told:
            self._told = closed
            command = new(
                GripperCommandMsg,
                position=0.0 if closed else self._open,
                max_effort=SkillsConfig.gripper_effort,
            )
            self._gripper.send_goal(new(GripperCommand.Goal, command=command))

    def _move(self, rates: tuple[float, float]) -> None:
        """Send lift and arm as far as they are to get within a step, from where they were sent before."""
        step_s, measured, positions = self.episode.step_s, self._measured("position"), []
        for joint, rate in zip(self._joints, rates, strict=True):
            limit, here = self._arm.limits[joint], measured[joint]
            wanted = self._targets.get(joint, here) + rate * step_s
            wanted = min(max(wanted, here - _AHEAD), here + _AHEAD)  # one that is blocked waits
            self._targets[joint] = min(max(wanted, limit.lower), limit.upper)
            positions.append(self._targets[joint])
        point = new(
            JointTrajectoryPoint,
            positions=np.array(positions),
            velocities=np.array(rates),
            time_from_start=duration(round(step_s * 1e9)),
        )
        stamped = header(self.episode.node.now_ns, "")
        self._trajectory.publish(
            JointTrajectory(header=stamped, joint_names=list(self._joints), points=[point])
        )

    def _measured(self, what: str) -> dict[str, float]:
        """Return the joints' `position` or `effort`."""
        state = self._states.message
        return dict(zip(state.name, getattr(state, what).tolist(), strict=False))

    # -- what it is shown ------------------------------------------------------------------------------------

    def observation_spaces(self) -> dict[str, spaces.Space[Any]]:
        """Return those of arm and gripper."""
        far, effort = 3.0, 2.0 * SkillsConfig.gripper_effort
        return {
            "grasp": spaces.Box(-far, far, (2,), np.float32),
            "gripper": spaces.Box(
                np.array([0.0, -effort], np.float32), np.array([0.3, effort], np.float32), dtype=np.float32
            ),
        }

    def observe(self) -> dict[str, Values]:
        """Return what encoders and drives tell.

        `grasp`: how far the middle between the fingers is ahead of the base's origin, and above the height at
        which the plan of the hall has the tote's middle [m]. `gripper`: how far each finger is open [m], and
        what it presses with [N].
        """
        position, effort = self._measured("position"), self._measured("effort")
        wrist = {self._arm.config.wrist_joint: 0.0}
        pose, _ = self._arm.forward(wrist | {joint: position[joint] for joint in self._joints})
        height = float(self._tote.T_map_tote.xyz[2])
        return {
            "grasp": np.array([pose.x, pose.z - height]),
            "gripper": np.array([position[self._finger], effort[self._finger]]),
        }
