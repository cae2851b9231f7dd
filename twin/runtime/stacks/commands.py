"""The nodes between whoever commands a velocity and the wheels."""

from __future__ import annotations

from dataclasses import replace

from twin.controllers.limiter import AxisLimits
from twin.controllers.velocity_smoother import VelocitySmootherConfig
from twin.geometry import Array
from twin.models.specs import DriveSpec
from twin.navigation.control.collision_monitor_config import (
    FOOTPRINT_APPROACH,
    CollisionMonitorConfig,
    MonitorPolygon,
)
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.navigation.velocity.collision_monitor import CollisionMonitorNode
from twin.nodes.navigation.velocity.twist_mux import TwistMuxNode
from twin.runtime.defaults.from_description import SCAN, scan_lidar
from twin.runtime.stacks.context import StackContext
from twin.scenario.collision_monitor import CollisionMonitorParameters

_GUARDED = "cmd_vel_muxed"
_REACTION_S = 0.2
"""Age of a scan, and a command's way to the wheels."""


def build_commands(
    context: StackContext,
    config: CollisionMonitorParameters,
    pose: RobotPose,
    footprint: Array,
    brakes: VelocitySmootherConfig,
) -> None:
    """Create the multiplexer, and behind it the collision monitor if the robot has what it looks with.

    Args:
        context: What the robot's nodes are built from.
        config: What the scenario overrides.
        pose: What the robot believes about its pose.
        footprint: Corners in the base frame, shape (n, 2) [m].
        brakes: What its drive can do.
    """
    bus, namespace = context.bus, context.namespace
    scans = config.scan_topics
    if scans is None:
        scans = () if scan_lidar(context.handle.description) is None else (SCAN,)
    if not config.enabled or not (scans or config.range_topics or config.clouds):
        TwistMuxNode(bus, namespace=namespace)
        return
    TwistMuxNode(bus, output=_GUARDED, namespace=namespace)
    polygons: tuple[MonitorPolygon, ...] = (_approach(brakes.linear),)
    if config.polygons is not None:
        polygons = tuple(polygon.config() for polygon in config.polygons)
    CollisionMonitorNode(
        bus,
        pose,
        footprint,
        replace(config.over(CollisionMonitorConfig()), polygons=polygons),
        brakes=brakes,
        hardest=_hardest(brakes.linear, context.handle.description.drive),
        cmd_vel_in=_GUARDED,
        scan_topics=scans,
        range_topics=config.range_topics,
        clouds=tuple(cloud.config() for cloud in config.clouds),
        namespace=namespace,
    )


def _hardest(limits: AxisLimits, drive: DriveSpec | None) -> float:
    """Return how many times harder than in `limits` a drive brakes when it must."""
    most = None if drive is None else drive.max_linear_acceleration
    return max(1.0, (most or limits.braking) / limits.braking)


def _approach(limits: AxisLimits) -> MonitorPolygon:
    """Return `approach` for a robot's brakes.

    It lets the robot drive at d / T, d before an obstacle, which takes a deceleration of v / T.
    """
    return replace(
        FOOTPRINT_APPROACH,
        time_before_collision=round(limits.max_velocity / limits.braking + _REACTION_S, 2),
        simulation_time_step=0.05,
    )
