"""Casters that stand under the chassis: they touch the floor, and nothing else before the chassis does."""

from __future__ import annotations

import numpy as np

from twin.geometry import Array, Pose3
from twin.models.description import RobotDescription
from twin.models.kinematics import link_poses
from twin.models.shapes import Box, Geometry, Sphere


def casters_under_chassis(description: RobotDescription) -> tuple[str, ...]:
    """Return the links that are frictionless balls, fixed to the root under a box that is fixed to it too.

    What they would touch besides the floor, the box above them touches first; so a world may leave them out
    of all other collisions, which saves a tenth of a step. (A sill lower than the box's underside, and
    narrower than the robot, is missed by the casters, not by the wheels.)
    """
    poses = link_poses(description)
    rigid = _fixed_to_root(description)
    roofs = [
        (poses[name] @ collision.T_link_geometry, np.array(collision.geometry.size) / 2.0)
        for name in rigid
        for collision in description.links[name].collisions
        if isinstance(collision.geometry, Box)
    ]
    casters = []
    for name in rigid:
        link = description.links[name]
        balls = [c for c in link.collisions if isinstance(c.geometry, Sphere)]
        if link.surface.friction != 0.0 or not balls or len(balls) != len(link.collisions):
            continue
        if all(
            any(_covers(*roof, (poses[name] @ ball.T_link_geometry).xyz, ball.geometry) for roof in roofs)
            for ball in balls
        ):
            casters.append(name)
    return tuple(casters)


def _covers(T_root_box: Pose3, half: Array, centre: Array, ball: Geometry) -> bool:
    """Whether an upright box covers a ball below its top, seen from above."""
    assert isinstance(ball, Sphere)
    local = T_root_box.inverse().apply(centre)
    beside = np.abs(local[:2]) + ball.radius > half[:2] + 1e-9
    return bool(not beside.any() and local[2] < half[2])


def _fixed_to_root(description: RobotDescription) -> list[str]:
    links = [description.root]
    for link in links:
        links += [joint.child for joint in description.children(link) if joint.type == "fixed"]
    return links
