"""Tags as MuJoCo draws them: a thin plate with a picture on it."""

from __future__ import annotations

import mujoco
import numpy as np

from twin.geometry import Pose3
from twin.perception.opencv import opencv
from twin.perception.tags.families import FAMILIES, picture
from twin.sim.scene import Tag

_PIXELS = 16
"""For each module; a power of two, so that the smaller pictures of far tags have the same edges."""
_THICKNESS = 0.002
"""[m]"""
T_TAG_PRINT = Pose3(np.zeros(3), np.array([0.5, 0.5, 0.5, 0.5]))
"""x to the right on the print, y up, z out of it: how apriltag_ros has the frame of a tag."""


def add_tag(spec: mujoco.MjSpec, body: mujoco.MjsBody, tag: Tag, group: int) -> None:
    """Add a tag to a body at the world's origin; its face is where its pose says.

    Raises:
        ScenarioError: OpenCV is not installed.
    """
    known, image = FAMILIES[tag.family], f"tag_{tag.family}_{tag.number}"
    if spec.texture(image) is None:
        grey = picture(tag.family, tag.number, _PIXELS)
        spec.assets[f"{image}.png"] = opencv().imencode(".png", grey)[1].tobytes()
        spec.add_texture(name=image, type=mujoco.mjtTexture.mjTEXTURE_2D, file=f"{image}.png")
        material = spec.add_material(name=image, specular=0.0, shininess=0.0)
        material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = image
    half = tag.size * (known.side + 4) / (known.side + 2) / 2.0
    T_world_print = tag.T_world_tag @ T_TAG_PRINT
    body.add_geom(
        name=tag.name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[half, half, _THICKNESS / 2.0],
        pos=T_world_print.apply((0.0, 0.0, -_THICKNESS / 2.0)),
        quat=T_world_print.quat_wxyz,
        material=image,
        contype=0,
        conaffinity=0,
        group=group,
    )
