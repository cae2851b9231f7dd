"""Tags as pictures that are stuck to something."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Pose3
from twin.perception.tags.families import FAMILIES, picture
from twin.sim.scene import Decal

_PIXELS = 16
"""For each module; a power of two, so that the smaller pictures of far tags have the same edges."""

T_TAG_PRINT = Pose3(np.zeros(3), np.array([0.5, 0.5, 0.5, 0.5]))
"""x to the right on the print, y up, z out of it: how apriltag_ros has the frame of a tag."""


def tag_decal(*, name: str, family: str, number: int, size: float, T_world_tag: Pose3) -> Decal:
    """Return a printed tag with a white border around it.

    Args:
        name: Unlike that of any other decal.
        family: One of `FAMILIES`.
        number: Its id.
        size: Side of its black border [m], as AprilTag counts.
        T_world_tag: Middle of its face, x out of it, z up along it.
    """
    side = FAMILIES[family].side
    whole = size * (side + 4) / (side + 2)

    def paint() -> NDArray[np.uint8]:
        return np.repeat(picture(family, number, _PIXELS)[..., None], 3, axis=-1)

    return Decal(name=name, size=(whole, whole), T_body_decal=T_world_tag @ T_TAG_PRINT, paint=paint)
