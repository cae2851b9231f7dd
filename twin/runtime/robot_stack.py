"""The nodes of one robot, in the order in which they run."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.bridge.bus import Bus
from twin.controllers.drive_config import drive_config
from twin.geometry import Pose2
from twin.models.description import RobotDescription
from twin.models.specs import LidarSpec
from twin.navigation.localisation.amcl import AmclConfig
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.navigation.recovery import BehaviorConfig
from twin.nodes.diff_drive_controller import DiffDriveControllerNode, DiffDriveNodeConfig
from twin.nodes.gripper_controller import GripperControllerNode
from twin.nodes.joint_state_broadcaster import JointStateBroadcasterNode
from twin.nodes.joint_trajectory_controller import JointTrajectoryControllerNode
from twin.nodes.navigation.amcl import AmclNode, InitialPose
from twin.nodes.navigation.behavior_server import BehaviorServerNode
from twin.nodes.navigation.bt_navigator import BtNavigatorNode
from twin.nodes.navigation.controller_server import ControllerServerNode
from twin.nodes.navigation.costmap import CostmapNode
from twin.nodes.navigation.docking_server import DockingServerNode
from twin.nodes.navigation.map_server import MapServerNode
from twin.nodes.navigation.planner_server import PlannerServerNode
from twin.nodes.navigation.robot_pose import Frames, RobotPose
from twin.nodes.navigation.static_localisation import StaticLocalisationNode
from twin.nodes.navigation.twist_mux import TwistMuxNode
from twin.nodes.navigation.velocity_smoother import VelocitySmootherNode
from twin.nodes.position_controller import PositionControllerNode
from twin.nodes.robot_state_publisher import RobotStatePublisherNode
from twin.nodes.sensor_publishers import SensorPublisher
from twin.nodes.tote_detector import ToteDetectorNode
from twin.nodes.transforms import TransformListenerNode
from twin.runtime import derive
from twin.runtime.navigation_config import navigation_parameters, overridden
from twin.scenario.navigation import NavigationConfig
from twin.scenario.robots import RobotConfig
from twin.sim.noise import NoiseStream
from twin.sim.robot import RobotHandle


@dataclass(frozen=True, kw_only=True)
class StackContext:
    """What the stack of one robot is built from."""

    bus: Bus
    config: RobotConfig
    handle: RobotHandle
    start: Pose2
    """Where the robot really starts; only its guess, off by the scenario's error, reaches localisation."""
    map: OccupancyMap | None
    seed: int
    control_period_ns: int
    spawn_height: float
    """Of the root link when the robot stands on the floor [m]."""
    track_ratio: float | None
    """Effective over geometric track of a skid steer, as calibrated."""
    namespace: str
    """'' for a single robot, '/name' among several."""


class RobotStack:
    """Builds and holds the nodes of one robot; what a robot lacks (drive, lidar, arm) is left out."""

    def __init__(self, context: StackContext) -> None:
        bus, handle, namespace = context.bus, context.handle, context.namespace
        description = handle.description
        self.name = handle.name
        self.handle = handle
        self._context = context
        self.spawn_height = context.spawn_height
        drive = description.drive
        base_frame = drive.base_frame if drive else description.root
        self.frames = Frames(odom=drive.odometry_frame if drive else "odom", base=base_frame)
        self.sensors = [SensorPublisher(bus, sensor, namespace=namespace) for sensor in handle.sensors]
        JointStateBroadcasterNode(
            bus, handle.hardware, period_ns=2 * context.control_period_ns, namespace=namespace
        )
        self._build_drive(description)
        RobotStatePublisherNode(bus, description, namespace=namespace)
        listener = TransformListenerNode(bus, namespace=namespace)
        self.robot_pose = RobotPose(listener.buffer, self.frames)
        self.manipulator = derive.manipulator(description)
        self.footprint = derive.footprint(description) if drive else np.zeros((1, 2))
        self.navigator: BtNavigatorNode | None = None
        self._build_localisation()
        if context.config.navigation is not None:
            self._build_navigation(context.config.navigation)
        elif drive is not None:
            BehaviorServerNode(
                bus,
                self.robot_pose,
                BehaviorConfig(),
                cmd_vel="cmd_vel",
                period_ns=context.control_period_ns,
                namespace=namespace,
            )
        self._build_arm(description)

    def _build_drive(self, description: RobotDescription) -> None:
        drive, context = description.drive, self._context
        if drive is None:
            return
        DiffDriveControllerNode(
            context.bus,
            self.handle.hardware,
            DiffDriveNodeConfig(
                drive=drive_config(drive, description, calibrated_ratio=context.track_ratio),
                left_joints=drive.left_joints,
                right_joints=drive.right_joints,
                odom_frame=self.frames.odom,
                base_frame=self.frames.base,
                period_ns=context.control_period_ns,
            ),
            namespace=context.namespace,
        )

    def _build_localisation(self) -> None:
        context, config = self._context, self._context.config.localisation
        if config is None or config.type == "none":
            return
        guess = _initial_guess(context.start, config.initial_pose_error, context.seed, self.name)
        if config.type == "odometry":
            StaticLocalisationNode(context.bus, self.frames, guess, namespace=context.namespace)
            return
        assert context.map is not None
        MapServerNode(context.bus, context.map, namespace=context.namespace)
        AmclNode(
            context.bus,
            self.robot_pose,
            overridden(AmclConfig(), config.parameters.overrides()),
            InitialPose.from_error(guess, config.initial_pose_error.xy, config.initial_pose_error.yaw),
            seed=context.seed,
            namespace=context.namespace,
        )

    def _build_navigation(self, config: NavigationConfig) -> None:
        context, namespace, bus = self._context, self._context.namespace, self._context.bus
        drive, pose = self.handle.description.drive, self.robot_pose
        assert drive is not None
        parameters = navigation_parameters(config, drive, self.footprint, self.frames)
        period_ns = context.control_period_ns
        TwistMuxNode(bus, namespace=namespace)
        VelocitySmootherNode(bus, parameters.smoother, period_ns=period_ns, namespace=namespace)
        global_costmap = CostmapNode(bus, pose, parameters.global_costmap, namespace=namespace)
        local_costmap = CostmapNode(bus, pose, parameters.local_costmap, namespace=namespace)
        PlannerServerNode(bus, pose, global_costmap, config=parameters.planner, namespace=namespace)
        ControllerServerNode(
            bus, pose, local_costmap, self.footprint, parameters.controller_server, namespace=namespace
        )
        BehaviorServerNode(
            bus,
            pose,
            parameters.behaviors,
            costmap=local_costmap,
            period_ns=period_ns,
            namespace=namespace,
        )
        sensors = self.handle.description.sensors
        if any(isinstance(sensor, LidarSpec) and sensor.topic == "scan" for sensor in sensors):
            DockingServerNode(bus, pose, namespace=namespace)
        self.navigator = BtNavigatorNode(bus, pose, namespace=namespace)

    def _build_arm(self, description: RobotDescription) -> None:
        bus, namespace, hardware = self._context.bus, self._context.namespace, self.handle.hardware
        if self.manipulator is None:
            if description.commands:
                PositionControllerNode(bus, hardware, tuple(description.commands), namespace=namespace)
            return
        JointTrajectoryControllerNode(bus, hardware, self.manipulator.arm_joints, namespace=namespace)
        GripperControllerNode(
            bus,
            hardware,
            self.manipulator.gripper_joint,
            period_ns=self._context.control_period_ns,
            namespace=namespace,
        )
        ToteDetectorNode(bus, self.robot_pose, namespace=namespace)


def _initial_guess(start: Pose2, error: Any, seed: int, name: str) -> Pose2:
    """Return the start as a person would click it: off by `error` in a direction drawn from the seed."""
    draw = NoiseStream(seed, f"{name}/initial_pose").uniform(0, 2)
    direction = 2.0 * math.pi * float(draw[0])
    sign = 1.0 if draw[1] < 0.5 else -1.0
    return Pose2(
        start.x + error.xy * math.cos(direction),
        start.y + error.xy * math.sin(direction),
        start.yaw + sign * error.yaw,
    )
