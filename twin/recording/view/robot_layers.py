"""What there is to see of a robot, in layers that the viewer can switch: shapes, frames, axes, masses."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import rerun as rr
from scipy.spatial.transform import Rotation

from twin.geometry import Array, matrix_from_quat_wxyz
from twin.models.description import Inertial, RobotDescription
from twin.recording.shapes import Drawing, Rgba8, Solid, draw_solids, rgba8

COLLISION_COLOUR: Rgba8 = (255, 140, 0, 110)
"""See-through, so that what is meant can be compared with what is touched."""
INERTIA_COLOUR: Rgba8 = (190, 90, 255, 255)
CENTRE_COLOUR: Rgba8 = (255, 220, 0, 255)
AXIS_COLOURS: Mapping[str, Rgba8] = MappingProxyType(
    {"revolute": (255, 90, 90, 255), "continuous": (255, 90, 90, 255), "prismatic": (80, 200, 255, 255)}
)
"""By joint type; planar joints have the colour of none, at their normal."""
PLANE_COLOUR: Rgba8 = (170, 220, 120, 255)
LEAD_DENSITY = 11340.0
"""RViz draws a mass as a ball of lead [kg/m³]."""


@dataclass(frozen=True, kw_only=True)
class Canvas:
    """Where the layers are drawn."""

    recording: rr.RecordingStream
    size: float
    """Of the robot [m]: arrows and axes are a fraction of it."""

    def draw(self, layer: str, name: str, frame: str, shape: rr.AsComponents) -> None:
        """Log what a layer has of a link or joint, in the frame of a link."""
        self.recording.log(entity(layer, name), rr.CoordinateFrame(frame), shape, static=True)


def visual(canvas: Canvas, description: RobotDescription) -> None:
    """Draw what the robot looks like."""
    drawings = [
        Drawing(
            entity("visual", link.name),
            link.name,
            [Solid(item.geometry, item.T_link_geometry, rgba8(item.rgba)) for item in link.visuals],
        )
        for link in description.links.values()
    ]
    draw_solids(canvas.recording, drawings)


def collision(canvas: Canvas, description: RobotDescription) -> None:
    """Draw what the robot touches with."""
    drawings = [
        Drawing(
            entity("collision", link.name),
            link.name,
            [Solid(item.geometry, item.T_link_geometry, COLLISION_COLOUR) for item in link.collisions],
        )
        for link in description.links.values()
    ]
    draw_solids(canvas.recording, drawings, see_through=True)


def frames(canvas: Canvas, description: RobotDescription) -> None:
    """Draw the axes of every link's frame, with its name."""
    for name in description.links:
        canvas.draw("frames", name, name, rr.TransformAxes3D(0.08 * canvas.size, show_frame=True))


def joint_axes(canvas: Canvas, description: RobotDescription) -> None:
    """Draw an arrow along the axis of every joint that has one."""
    length = 0.15 * canvas.size
    for joint in description.joints.values():
        if joint.type in ("fixed", "floating"):
            continue
        arrow = rr.Arrows3D(
            vectors=[length * np.array(joint.axis)],
            colors=[AXIS_COLOURS.get(joint.type, PLANE_COLOUR)],
            radii=[0.04 * length],
            labels=[joint.name],
        )
        # The axis of a joint is fixed in the child's frame too: the motion is about or along it.
        canvas.draw("joint_axes", joint.name, joint.child, arrow)


def inertia(canvas: Canvas, description: RobotDescription) -> None:
    """Draw the box that has each link's inertia, if it were homogeneous."""
    for name, inertial in _masses(description):
        size, R = inertia_box(inertial)
        axes = Rotation.from_matrix(matrix_from_quat_wxyz(inertial.T_link_com.quat_wxyz) @ R)
        box = rr.Boxes3D(
            sizes=[size],
            centers=[inertial.T_link_com.xyz],
            quaternions=[rr.Quaternion(xyzw=axes.as_quat())],
            colors=[INERTIA_COLOUR],
        )
        canvas.draw("inertia", name, name, box)


def centre_of_mass(canvas: Canvas, description: RobotDescription) -> None:
    """Draw each link's mass as a ball of lead about its centre, with the mass in words."""
    for name, inertial in _masses(description):
        ball = rr.Ellipsoids3D(
            centers=[inertial.T_link_com.xyz],
            radii=[(3.0 * inertial.mass / (4.0 * math.pi * LEAD_DENSITY)) ** (1.0 / 3.0)],
            colors=[CENTRE_COLOUR],
            labels=[f"{inertial.mass:.4g} kg"],
            fill_mode="solid",
        )
        canvas.draw("centre_of_mass", name, name, ball)


LAYERS: Mapping[str, Callable[[Canvas, RobotDescription], None]] = MappingProxyType(
    {draw.__name__: draw for draw in (visual, collision, frames, joint_axes, inertia, centre_of_mass)}
)
"""By name; each is the top of its entities' paths."""


def entity(layer: str, name: str) -> str:
    """Return the path of a link or joint in a layer, whatever characters its name has."""
    return rr.new_entity_path([layer, name])


def inertia_box(inertial: Inertial) -> tuple[Array, Array]:
    """Return the homogeneous box with a link's mass and inertia: edges [m], shape (3,), and its axes.

    The axes are the columns of a rotation in the inertial frame, shape (3, 3). For a box of mass m,
    I_x = m (y² + z²) / 12, and so on; an inertia that nothing can have gives an edge of zero.
    """
    moments, R = np.linalg.eigh(inertial.inertia)
    if np.linalg.det(R) < 0.0:
        R[:, 0] *= -1.0
    squares = 6.0 * (moments.sum() - 2.0 * moments) / inertial.mass
    return np.sqrt(np.maximum(squares, 0.0)), R


def _masses(description: RobotDescription) -> list[tuple[str, Inertial]]:
    return [
        (name, link.inertial)
        for name, link in description.links.items()
        if link.inertial is not None and link.inertial.mass > 0.0
    ]
