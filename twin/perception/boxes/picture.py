"""What a camera of depths shows, as points seen by a camera that looks level."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose3, matrix_from_quat_wxyz
from twin.models.lens import Lens

_LEAST_FORWARD = 0.3
"""A camera whose axis has less than this in the horizontal plane looks down, not ahead."""


@dataclass(frozen=True, kw_only=True)
class Picture:
    """One image of depths, with the colours of the same pixels if there are any."""

    depth: NDArray[np.float32]
    """z along the optical axis [m], nan where there is none, shape (height, width)."""
    colours: NDArray[np.uint8] | None = None
    """Red, green and blue, shape (height, width, 3)."""
    matrix: Array
    """K of CameraInfo, shape (3, 3)."""
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    """D of it, as `plumb_bob` has it."""
    T_base_camera: Pose3
    """Of the optical frame (REP-103); z of the base is up."""


@dataclass(frozen=True, kw_only=True)
class LevelView:
    """The same as a camera in the same place would see that looks level: plumb edges are columns of it.

    Its frame: x ahead, y to the left, z up, from where the camera is.
    """

    xyz: Array
    """Points [m], nan where there are none, shape (height, width, 3)."""
    inside: NDArray[np.bool_]
    """Which pixels the picture has, with a depth or without, shape (height, width)."""
    colours: Array | None
    """Shape (height, width, 3), from 0 to 255."""
    aside: Array
    """-y / x of each column's middle, shape (width,)."""
    down: Array
    """-z / x of each row's middle, shape (height,)."""
    T_base_view: Pose3

    @property
    def pixel(self) -> float:
        """Distance of two columns, or rows, at x = 1."""
        return float(self.aside[1] - self.aside[0])


def level_view(picture: Picture) -> LevelView | None:
    """Return a picture as seen level, pixel by pixel, the nearest one each; None if it looks down or up.

    Raises:
        ValueError: It is no picture: without pixels, or shapes do not fit.
    """
    height, width = _checked(picture)
    R_base_camera = matrix_from_quat_wxyz(picture.T_base_camera.quat_wxyz)
    ahead = R_base_camera[:, 2] * (1.0, 1.0, 0.0)
    if not float(np.linalg.norm(ahead)) > _LEAST_FORWARD or not np.isfinite(picture.T_base_camera.xyz).all():
        return None
    yaw = float(np.arctan2(ahead[1], ahead[0]))
    T_base_view = Pose3.from_xyz_rpy(picture.T_base_camera.xyz, (0.0, 0.0, yaw))
    # A robot's joints tremble; a level view of a millionth of a radian less is as good, and there already.
    R_view_camera = (matrix_from_quat_wxyz(T_base_view.quat_wxyz).T @ R_base_camera).round(6)
    fx, fy, cx, cy = picture.matrix[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
    turn = tuple(R_view_camera.ravel().tolist())
    pixels, rays = _gathered(turn, (fx, fy, cx, cy), picture.distortion, (height, width))
    depths = picture.depth.ravel()[pixels].astype(np.float64)
    depths[~(depths > 0.0) | ~np.isfinite(depths)] = np.nan
    colours = None
    if picture.colours is not None:
        colours = picture.colours.reshape(-1, 3)[pixels].astype(np.float64).reshape(height, width, 3)
    return LevelView(
        xyz=(rays * depths[:, None]).reshape(height, width, 3),
        inside=np.isfinite(rays[:, 0]).reshape(height, width),
        colours=colours,
        aside=(np.arange(width) - cx) / fx,
        down=(np.arange(height) - cy) / fx,
        T_base_view=T_base_view,
    )


@lru_cache(maxsize=8)
def _gathered(
    turn: tuple[float, ...],
    lens: tuple[float, float, float, float],
    distortion: tuple[float, float, float, float, float],
    size: tuple[int, int],
) -> tuple[NDArray[np.intp], Array]:
    """Return which pixel is seen where, and what it shows at z = 1 in the level frame, nan: nothing.

    Args:
        turn: The level frame's rotation matrix of the camera, row by row.
        lens: Focal lengths and centre, both ways [pixels].
        distortion: Of the lens.
        size: Height and width.
    """
    (height, width), (fx, fy, cx, cy) = size, lens
    R_view_camera = np.array(turn).reshape(3, 3)
    aside, down = (np.arange(width) - cx) / fx, (np.arange(height) - cy) / fx
    level = np.stack(np.broadcast_arrays(1.0, -aside[None, :], -down[:, None]), axis=-1).reshape(-1, 3)
    x, y, z = (level @ R_view_camera).T
    with np.errstate(divide="ignore", invalid="ignore"):
        seen = np.stack((x / z, y / z), axis=-1)
    seen[z <= 0.0] = np.nan
    plain = Lens(width=width, height=height, horizontal_fov=1.0, distortion=distortion)
    at = np.rint(np.nan_to_num(plain.distorted(seen) * (fx, fy) + (cx, cy), nan=-1.0))
    inside = ((at >= 0.0) & (at <= (width - 1, height - 1))).all(axis=1)
    at[~inside] = 0.0
    u, v = at.astype(np.intp).T
    rays = np.column_stack((seen, np.ones(len(seen)))) @ R_view_camera.T
    rays[~inside] = np.nan
    return v * width + u, rays


def _checked(picture: Picture) -> tuple[int, int]:
    """Return height and width; raises ValueError."""
    if picture.depth.ndim != 2 or min(picture.depth.shape) < 2:
        raise ValueError(f"a picture of depths has rows and columns, not shape {picture.depth.shape}")
    if picture.colours is not None and picture.colours.shape != (*picture.depth.shape, 3):
        raise ValueError(f"colours of shape {picture.colours.shape} do not fit depths {picture.depth.shape}")
    if not np.isfinite(picture.matrix).all() or min(picture.matrix[0, 0], picture.matrix[1, 1]) <= 0.0:
        raise ValueError("the camera's matrix K has no focal length")
    height, width = picture.depth.shape
    return height, width
