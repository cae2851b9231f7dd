"""Whether an approach would touch something (opennav_docking's Controller::isTrajectoryCollisionFree)."""

from __future__ import annotations

import copy

from twin.geometry import Array, Pose2
from twin.navigation.costmaps.costmap import Costmap, collision_step
from twin.navigation.docking.config import DockCollisionConfig
from twin.navigation.docking.line_approach import LineApproach


def collision_ahead(
    approach: LineApproach,
    pose: Pose2,
    docked: Pose2,
    costmap: Costmap,
    footprint: Array,
    config: DockCollisionConfig,
) -> Pose2 | None:
    """Return where the robot would touch something if the approach went on; None if nowhere.

    Args:
        approach: As far as it is; it stays so.
        pose: Of the base, in the costmap's frame, as all poses here.
        docked: Where the base stands at the dock.
        costmap: What is in the way.
        footprint: As `collision_step` takes it, shape (n, 2) [m].
        config: How far is looked ahead.
    """
    if not config.use_collision_detection:
        return None
    ghost, dt = copy.copy(approach), config.simulation_time_step
    for _ in range(round(config.projection_time / dt)):
        step = ghost.update(pose, dt)
        if step.done or step.failed_reason is not None:
            return None
        pose = pose @ Pose2(step.v * dt, 0.0, step.w * dt)
        if pose.distance(docked) < config.dock_collision_threshold:
            if not approach.backward:
                return None  # the rest leads nearer still
        elif collision_step(costmap, footprint, pose, (0.0, 0.0), 0.0, 0) == 0:
            return pose
    return None
