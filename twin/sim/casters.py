"""Casters that stand under the chassis: they touch the floor, and nothing else before the chassis does."""

from __future__ import annotations

import numpy as np

from twin.geometry import Array, Pose3
from twin.models.description import RobotDescription
from twin.models.kinematics import link_poses, rigid_groups
from twin.models.shapes import Box, Sphere


def casters_under_chassis(description: RobotDescription) -> tuple[str, ...]:
    """Return the links that are frictionless balls, fixed to the root under a box that is fixed to it too.

    What they would touch besides the floor, the box above them touches first; so a world may leave them out
    of all other collisions, which saves a tenth of a step. (A sill lower than the box's underside, and
    narrower than the robot, is missed by the casters, not by the wheels.)
    """
    poses = link_poses(description)
    rigid = [link for link, head in rigid_groups(description).items() if head == description.root]
    roofs = [
        (poses[name] @ collision.T_link_geometry, np.array(collision.geometry.size) / 2.0)
        for name in rigid
        for collision in description.links[name].collisions
        if isinstance(collision.geometry, Box)
    ]
    casters = []
    for name in rigid:
        link = description.links[name]
        balls = [
            ((poses[name] @ collision.T_link_geometry).xyz, collision.geometry)
            for collision in link.collisions
            if isinstance(collision.geometry, Sphere)
        ]
        slippery = link.surface.friction == 0.0 and 0 < len(balls) == len(link.collisions)
        if slippery and all(any(_covers(*roof, *ball) for roof in roofs) for ball in balls):
            casters.append(name)
    return tuple(casters)


def _covers(T_root_box: Pose3, half: Array, centre: Array, ball: Sphere) -> bool:
    """Whether an upright box covers a ball below its top, seen from above."""
    local = T_root_box.inverse().apply(centre)
    beside = np.abs(local[:2]) + ball.radius > half[:2] + 1e-9
    return bool(not beside.any() and local[2] < half[2])
