"""The nodes of one robot, in the order in which they run."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from twin.bridge.bus import Bus
from twin.controllers.limiter import AxisLimits
from twin.controllers.twist_mux import MuxInput
from twin.controllers.velocity_smoother import VelocitySmootherConfig
from twin.geometry import Pose2
from twin.models.description import LidarSpec, RobotDescription
from twin.navigation.amcl import AmclConfig
from twin.navigation.goal_checker import GoalCheckerConfig
from twin.navigation.layered_costmap import CostmapConfig
from twin.navigation.occupancy_map import OccupancyMap
from twin.navigation.planner import PlannerConfig
from twin.navigation.progress_checker import ProgressCheckerConfig
from twin.navigation.recovery import BehaviorConfig
from twin.navigation.regulated_pure_pursuit import RegulatedPurePursuitConfig
from twin.nodes.amcl import AmclNode, InitialPose
from twin.nodes.behavior_server import BehaviorServerNode
from twin.nodes.bt_navigator import BtNavigatorNode
from twin.nodes.controller_server import ControllerServerConfig, ControllerServerNode
from twin.nodes.costmap import CostmapNode, CostmapNodeConfig
from twin.nodes.diff_drive_controller import DiffDriveControllerNode, DiffDriveNodeConfig
from twin.nodes.docking_server import DockingServerNode
from twin.nodes.gripper_controller import GripperControllerNode
from twin.nodes.joint_state_broadcaster import JointStateBroadcasterNode
from twin.nodes.joint_trajectory_controller import JointTrajectoryControllerNode
from twin.nodes.map_server import MapServerNode
from twin.nodes.planner_server import PlannerServerNode
from twin.nodes.position_controller import PositionControllerNode
from twin.nodes.robot_pose import Frames, RobotPose
from twin.nodes.robot_state_publisher import RobotStatePublisherNode
from twin.nodes.sensor_publishers import SensorPublisher
from twin.nodes.static_localisation import StaticLocalisationNode
from twin.nodes.tote_detector import ToteDetectorNode
from twin.nodes.transforms import TransformListenerNode
from twin.nodes.twist_mux import TwistMuxNode
from twin.nodes.velocity_smoother import VelocitySmootherNode
from twin.runtime import derive
from twin.scenario.navigation import AmclLocalisation, NavigationConfig, ParameterGroup
from twin.scenario.robots import RobotConfig
from twin.sim.noise import NoiseStream
from twin.sim.robot import RobotHandle

C = TypeVar("C")


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
            bus, handle.hardware, period_ns=context.control_period_ns, namespace=namespace
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
                drive=derive.drive_config(drive, description),
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
            _with(AmclConfig(), config.parameters.overrides()),
            InitialPose.from_error(guess, config.initial_pose_error.xy, config.initial_pose_error.yaw),
            seed=context.seed,
            namespace=context.namespace,
        )

    def _build_navigation(self, config: NavigationConfig) -> None:
        context, namespace, bus = self._context, self._context.namespace, self._context.bus
        drive = self.handle.description.drive
        assert drive is not None
        polygon = tuple(map(tuple, self.footprint.tolist()))
        linear = config.max_linear_speed or drive.max_linear_velocity or 1.0
        angular = config.max_angular_speed or drive.max_angular_velocity or 1.5
        TwistMuxNode(
            bus,
            inputs=(
                MuxInput(name="navigation", topic="cmd_vel_smoothed", priority=10),
                MuxInput(name="docking", topic="cmd_vel_docking", priority=20),
                MuxInput(name="teleop", topic="cmd_vel_teleop", priority=100),
            ),
            namespace=namespace,
        )
        VelocitySmootherNode(
            bus,
            VelocitySmootherConfig(
                linear=AxisLimits(max_velocity=linear, max_acceleration=0.8, max_deceleration=1.2),
                angular=AxisLimits(max_velocity=angular, max_acceleration=2.0, max_deceleration=3.0),
            ),
            period_ns=context.control_period_ns,
            namespace=namespace,
        )
        layers = CostmapConfig(
            footprint=polygon,
            inflation_radius=0.8,
            cost_scaling_factor=4.0,
            obstacle_max_range=4.0,
            raytrace_max_range=5.0,
        )
        global_costmap = CostmapNode(
            bus,
            self.robot_pose,
            _costmap("global_costmap", self.frames.map, layers, config.global_costmap, 500_000_000),
            namespace=namespace,
        )
        local_costmap = CostmapNode(
            bus,
            self.robot_pose,
            _costmap(
                "local_costmap",
                self.frames.odom,
                replace(layers, rolling_window=True, width=4.0, height=4.0, obstacle_max_range=3.0),
                config.local_costmap,
                200_000_000,
            ),
            namespace=namespace,
        )
        PlannerServerNode(
            bus,
            self.robot_pose,
            global_costmap,
            config=_with(PlannerConfig(tolerance=0.1, allow_unknown=False), config.planner.overrides()),
            namespace=namespace,
        )
        controller = config.controller.overrides()
        period_ns = _period_ns(controller.pop("controller_frequency", None), 60_000_000)
        goal_checker = _with(GoalCheckerConfig(xy_goal_tolerance=0.08, yaw_goal_tolerance=0.05), controller)
        ControllerServerNode(
            bus,
            self.robot_pose,
            local_costmap,
            self.footprint,
            ControllerServerConfig(
                controller=_with(
                    RegulatedPurePursuitConfig(
                        desired_linear_vel=linear,
                        use_velocity_scaled_lookahead_dist=True,
                        min_lookahead_dist=0.35,
                        max_lookahead_dist=1.0,
                        lookahead_time=1.0,
                        rotate_to_heading_angular_vel=min(1.2, angular),
                        max_angular_accel=2.0,
                        rotate_to_heading_min_angle=0.6,
                        xy_goal_tolerance=goal_checker.xy_goal_tolerance,
                    ),
                    controller,
                ),
                goal_checker=goal_checker,
                progress_checker=_with(ProgressCheckerConfig(), controller),
                controller_period_ns=period_ns,
            ),
            namespace=namespace,
        )
        BehaviorServerNode(
            bus,
            self.robot_pose,
            BehaviorConfig(footprint=polygon),
            costmap=local_costmap,
            period_ns=context.control_period_ns,
            namespace=namespace,
        )
        lidar = self.handle.description.sensors
        if any(isinstance(sensor, LidarSpec) and sensor.topic == "scan" for sensor in lidar):
            DockingServerNode(bus, self.robot_pose, namespace=namespace)
        self.navigator = BtNavigatorNode(bus, self.robot_pose, namespace=namespace)

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


def _with(config: C, overrides: Mapping[str, Any]) -> C:
    """Return a config with those overrides that are its own fields and are given."""
    own = {field.name for field in fields(config)}  # type: ignore[arg-type]
    return replace(config, **{k: v for k, v in overrides.items() if k in own and v is not None})  # type: ignore[type-var]


def _costmap(
    name: str, frame: str, layers: CostmapConfig, group: ParameterGroup, period_ns: int
) -> CostmapNodeConfig:
    overrides = group.overrides()
    return CostmapNodeConfig(
        name=name,
        frame=frame,
        layers=_with(layers, overrides),
        update_period_ns=_period_ns(overrides.get("update_frequency"), period_ns),
    )


def _period_ns(frequency: float | None, default: int) -> int:
    return default if frequency is None else round(1e9 / frequency)


def map_of(config: RobotConfig, arena_map: Path | None) -> Path | None:
    """Return the map file that a robot localises on; the arena's own unless the scenario names one."""
    if not isinstance(config.localisation, AmclLocalisation):
        return None
    return Path(config.localisation.map) if config.localisation.map is not None else arena_map
