"""The nodes between whoever commands a velocity and the wheels."""

from __future__ import annotations

from twin.geometry import Array
from twin.navigation.control.collision_monitor import CollisionMonitorConfig, MonitorPolygon
from twin.nodes.navigation.collision_monitor import CollisionMonitorNode
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.navigation.twist_mux import TwistMuxNode
from twin.runtime.stack_context import StackContext
from twin.scenario.collision_monitor import CollisionMonitorParameters

_GUARDED = "cmd_vel_muxed"


def build_commands(
    context: StackContext, config: CollisionMonitorParameters | None, pose: RobotPose, footprint: Array
) -> None:
    """Create the multiplexer, and behind it the collision monitor if the scenario has one."""
    bus, namespace = context.bus, context.namespace
    if config is None:
        TwistMuxNode(bus, namespace=namespace)
        return
    TwistMuxNode(bus, output=_GUARDED, namespace=namespace)
    CollisionMonitorNode(
        bus,
        pose,
        footprint,
        CollisionMonitorConfig(
            polygons=tuple(MonitorPolygon(**polygon.model_dump()) for polygon in config.polygons),
            source_timeout_ns=round(config.source_timeout * 1e9),
        ),
        cmd_vel_in=_GUARDED,
        range_topics=config.range_topics,
        namespace=namespace,
    )
