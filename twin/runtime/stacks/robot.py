"""The nodes of one robot, in the order in which they run."""

from __future__ import annotations

import logging
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from twin.controllers.drive_config import drive_config, odometry_noise
from twin.geometry import Pose2, Pose3
from twin.models.description import RobotDescription
from twin.navigation.recovery import BehaviorConfig
from twin.nodes.diff_drive_controller import DiffDriveControllerNode, DiffDriveNodeConfig
from twin.nodes.guard.drive_stop import DriveStopNode
from twin.nodes.joint_state_broadcaster import JointStateBroadcasterNode
from twin.nodes.navigation.robot_pose import Frames, RobotPose
from twin.nodes.robot_state_publisher import RobotStatePublisherNode
from twin.nodes.sensor_publishers import SensorPublisher
from twin.nodes.transforms import TransformListenerNode
from twin.runtime.defaults import from_description as derive
from twin.runtime.stacks.context import StackContext
from twin.runtime.stacks.localisation import build_localisation

if TYPE_CHECKING:
    from twin.navigation.docking.docks import DockDatabase
    from twin.nodes.battery_state_broadcaster import BatteryStateBroadcasterNode
    from twin.nodes.cameras.camera import CameraPublisher
    from twin.nodes.navigation.bt_navigator import BtNavigatorNode
    from twin.nodes.navigation.localisation.ekf import EkfNode
    from twin.nodes.navigation.localisation.ekf_config import EkfNodeConfig
    from twin.nodes.navigation.mapping.slam_toolbox import SlamToolboxNode


class RobotStack:
    """Builds and holds the nodes of one robot; what a robot lacks is not even imported."""

    def __init__(self, context: StackContext) -> None:
        bus, handle, namespace = context.bus, context.handle, context.hardware_namespace
        bus.group = context.namespace
        description = handle.description
        self.name = handle.name
        self.handle = handle
        self.context = context
        drive = description.drive
        base_frame = drive.base_frame if drive else description.root
        self.frames = Frames(odom=drive.odometry_frame if drive else "odom", base=base_frame)
        self.sensors = [SensorPublisher(bus, sensor, namespace=namespace) for sensor in handle.sensors]
        self.cameras = _cameras(context)
        JointStateBroadcasterNode(
            bus, handle.hardware, period_ns=2 * context.control_period_ns, namespace=namespace
        )
        self.battery = self._build_battery()
        fusion: EkfNodeConfig | None = None
        if context.config.odometry.type != "wheels":
            from twin.nodes.navigation.localisation.ekf import EkfNode
            from twin.runtime.stacks.odometry_filter import odometry_filter, warn_of_unpublished_sources

            fusion, told = odometry_filter(context, self.frames)
        self.drive = self._build_drive(description, enable_odom_tf=fusion is None or not fusion.publish_tf)
        self.filter: EkfNode | None = None
        if fusion is not None:
            self.filter = EkfNode(bus, fusion, namespace=namespace)
            for sentence in told:
                self.filter.node.get_logger().warn(sentence)
        RobotStatePublisherNode(bus, description, namespace=namespace)
        listener = TransformListenerNode(bus, namespace=context.namespace)
        self.robot_pose = RobotPose(listener.buffer, self.frames)
        if context.config.lidar_odometry is not None:
            from twin.runtime.stacks.lidar_odometry import build_lidar_odometry

            build_lidar_odometry(context, listener.buffer, self.frames.base)
        self.manipulator = derive.manipulator(description)
        self.footprint = derive.footprint(description) if drive else np.zeros((1, 2))
        self.navigator: BtNavigatorNode | None = None
        self.slam: SlamToolboxNode | None = None
        if context.config.apriltag is not None:
            from twin.runtime.stacks.apriltag import build_apriltag

            build_apriltag(context, context.config.apriltag)
        self._build_autonomy()
        self._build_arm(description)
        if self.filter is not None:
            warn_of_unpublished_sources(context, self.filter)

    def place_odometry(self, pose: Pose2) -> None:
        """Let odometry, and the filter of it, go on from a pose in the odometry frame."""
        if self.drive is not None:
            self.drive.odometry.place(pose)
        if self.filter is not None:
            self.filter.place(pose)

    def standing(self, pose: Pose2) -> Pose3:
        """Return the pose of the base when it stands on the floor at `pose`."""
        return Pose3.from_pose2(pose, self.context.spawn_height)

    def _build_drive(
        self, description: RobotDescription, *, enable_odom_tf: bool
    ) -> DiffDriveControllerNode | None:
        drive, context = description.drive, self.context
        if drive is None:
            return None
        node = DiffDriveControllerNode(
            context.bus,
            self.handle.hardware,
            DiffDriveNodeConfig(
                drive=drive_config(drive, description, calibrated_ratio=context.track_ratio),
                left_joints=drive.left_joints,
                right_joints=drive.right_joints,
                odom_frame=self.frames.odom,
                base_frame=self.frames.base,
                noise=odometry_noise(drive, description),
                period_ns=context.control_period_ns,
                use_imu=getattr(context.config.localisation, "use_imu", False),
                enable_odom_tf=enable_odom_tf,
            ),
            namespace=context.hardware_namespace,
        )
        if context.layout.autonomy == "all" and not context.layout.hardware:
            DriveStopNode(
                context.bus,
                node.controller,
                deceleration=context.config.emergency_deceleration,
                namespace=context.namespace,
            )
        if drive.guessed:
            node.node.get_logger().warn(
                f"'{self.name}' has no drive plugin; by its wheels it is {drive.words}"
            )
        return node

    def _build_battery(self) -> BatteryStateBroadcasterNode | None:
        if self.context.battery is None:
            return None
        from twin.nodes.battery_state_broadcaster import BatteryStateBroadcasterNode

        return BatteryStateBroadcasterNode(
            self.context.bus,
            name=self.context.battery.battery_name,
            frame=self.handle.description.root,
            namespace=self.context.hardware_namespace,
        )

    def _build_autonomy(self) -> None:
        context, pose = self.context, self.robot_pose
        if context.layout.autonomy == "none":
            return
        self.slam = build_localisation(context, pose)
        if context.layout.autonomy == "localisation":
            return
        if context.config.navigation is not None:
            self.navigate()
        elif self.drive is not None:
            from twin.nodes.navigation.behavior_server import BehaviorServerNode

            BehaviorServerNode(
                context.bus,
                pose,
                BehaviorConfig(),
                cmd_vel="cmd_vel",
                period_ns=context.control_period_ns,
                namespace=context.namespace,
            )

    def navigate(self) -> None:
        """Build the nodes of navigation, which `config` asks for."""
        from twin.runtime.stacks.navigation import build_navigation

        context, config = self.context, self.context.config.navigation
        assert config is not None
        context.bus.group = context.namespace
        self.navigator = build_navigation(context, config, self.robot_pose, self.footprint)

    def docks(self) -> DockDatabase:
        """Return where it can dock, whoever sends it there."""
        from twin.navigation.docking.docks import DockDatabase

        context, config = self.context, self.context.config.navigation
        if config is None or self.drive is None:
            return DockDatabase()
        from twin.runtime.parameter_files.nav2.parameters import with_plugins
        from twin.runtime.stacks.navigation import parameters_of

        config = with_plugins(config, context.namespace)
        return parameters_of(context, config, self.frames, self.footprint)[0].docking.database

    def _build_arm(self, description: RobotDescription) -> None:
        context, hardware = self.context, self.handle.hardware
        bus, namespace = context.bus, context.hardware_namespace
        if self.manipulator is None:
            if description.commands:
                from twin.nodes.position_controller import PositionControllerNode

                PositionControllerNode(bus, hardware, tuple(description.commands), namespace=namespace)
            return
        from twin.nodes.gripper_controller import GripperControllerNode
        from twin.nodes.joint_trajectory_controller import JointTrajectoryControllerNode

        JointTrajectoryControllerNode(bus, hardware, self.manipulator.arm_joints, namespace=namespace)
        GripperControllerNode(
            bus,
            hardware,
            self.manipulator.gripper_joint,
            period_ns=context.control_period_ns,
            namespace=namespace,
        )
        if context.layout.autonomy != "all":
            return
        from twin.runtime.stacks.tote_detector import build_tote_detector

        build_tote_detector(context, self.robot_pose)


def _cameras(context: StackContext) -> list[CameraPublisher]:
    cameras, need = context.handle.cameras, context.config.cameras
    if need == "off":
        return []
    for warning in context.handle.description.left_out:
        _tell(str(warning))
    if not cameras:
        return []
    from twin.nodes.cameras.camera import CameraPublisher
    from twin.nodes.cameras.truth import TruthPublisher

    description, namespace = context.handle.description, context.hardware_namespace
    kinds = [TruthPublisher if camera.spec.truth else CameraPublisher for camera in cameras]
    return [
        kind(context.bus, camera, description, namespace=namespace, need=need)
        for kind, camera in zip(kinds, cameras, strict=True)
    ]


@cache
def _tell(warning: str) -> None:
    """Tell once in a process, not to /rosout: what is left out of a file is no part of what the run is."""
    logging.getLogger("twin.camera").warning(warning)
