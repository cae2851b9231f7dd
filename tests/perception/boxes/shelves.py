"""A shelf as a camera at a palm would see it, by casting a ray for each pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.geometry import Array, Pose2, Pose3, matrix_from_quat_wxyz
from twin.models.lens import Lens
from twin.models.optical_frames import T_CAMERA_OPTICAL
from twin.models.specs import DepthNoise
from twin.perception.boxes.picture import Picture
from twin.sim.cameras.depth_noise import noisy

LEVEL, EYE = 0.8, 0.122
"""Height of the board, and of the camera above it [m]."""
LENS = Lens(width=320, height=240, horizontal_fov=1.2)
GREY = (205, 206, 204)


@dataclass(frozen=True, kw_only=True)
class Block:
    """A box; the middle of its front's lower edge is at `front`, `bottom` above the floor [m]."""

    front: Pose2
    size: tuple[float, float, float]
    """Depth, width and height [m]."""
    colour: tuple[int, int, int] = (200, 40, 40)
    bottom: float = LEVEL
    label: tuple[float, float, float, float] | None = None
    """A white part of the front: its left and right end from the middle, and its lower and upper end [m]."""


def shelf(edge: float = 0.5) -> list[Block]:
    """Return a rack of two boards with uprights, and a wall behind it, its front edge so far away [m]."""
    boards = [
        Block(front=Pose2(edge, 0.0, 0.0), size=(0.6, 4.0, 0.03), colour=GREY, bottom=level - 0.03)
        for level in (LEVEL, LEVEL + 0.4)
    ]
    posts = [
        Block(front=Pose2(edge + x, y, 0.0), size=(0.05, 0.05, 1.2), colour=(30, 60, 150), bottom=0.3)
        for x in (0.0, 0.55)
        for y in (0.45, -0.5)
    ]
    wall = Block(front=Pose2(edge + 1.5, 0.0, 0.0), size=(0.1, 9.0, 3.0), colour=GREY, bottom=0.0)
    return [*boards, *posts, wall]


def picture(
    *things: Block,
    T_base_camera: Pose3 | None = None,
    noise: DepthNoise | None = None,
    seed: int = 0,
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0),
) -> Picture:
    """Return what the camera sees; without a pose it looks along x, in the plane of symmetry."""
    pose = T_base_camera or Pose3.from_xyz_rpy((0.0, 0.0, LEVEL + EYE))
    optical = pose @ T_CAMERA_OPTICAL
    lens = Lens(width=LENS.width, height=LENS.height, horizontal_fov=1.2, distortion=distortion)
    rays = np.concatenate((lens.rays(), np.ones((LENS.height, LENS.width, 1))), axis=-1)
    ways = rays @ matrix_from_quat_wxyz(optical.quat_wxyz).T
    depth = np.full(ways.shape[:2], np.inf)
    colours = np.zeros((*depth.shape, 3), np.uint8)
    with np.errstate(divide="ignore", invalid="ignore"):
        for thing in things:
            z, seen = _hit(thing, optical.xyz, ways)
            nearer = z < depth
            depth[nearer], colours[nearer] = z[nearer], seen[nearer]
    depth[np.isinf(depth)] = np.nan
    z32 = depth.astype(np.float32)
    draw = np.random.default_rng(seed)
    if noise is not None:
        z32 = noisy(z32, noise, LENS.focal_length, draw.normal(size=z32.shape))
        grain = draw.normal(0.0, 2.0, colours.shape)
        colours = np.clip(np.rint(colours + grain), 0, 255).astype(np.uint8)
    return Picture(
        depth=z32, colours=colours, matrix=LENS.matrix, distortion=distortion, T_base_camera=optical
    )


def _hit(thing: Block, eye: Array, ways: Array) -> tuple[Array, Array]:
    """Return how many times a ray's way it is to a box (inf: it misses), and the colour there."""
    frame = Pose3.from_pose2(thing.front, thing.bottom)
    turn = matrix_from_quat_wxyz(frame.quat_wxyz)
    start, way = (eye - frame.xyz) @ turn, ways @ turn
    depth, width, height = thing.size
    low, high = np.array((0.0, -width / 2.0, 0.0)), np.array((depth, width / 2.0, height))
    one, other = (low - start) / way, (high - start) / way
    first = np.minimum(one, other).max(axis=-1)
    last = np.maximum(one, other).min(axis=-1)
    z = np.where((first < last) & (first > 0.0), first, np.inf)
    colours = np.broadcast_to(np.array(thing.colour, np.uint8), (*z.shape, 3)).copy()
    if thing.label is not None:
        at = start + way * np.where(np.isinf(z), 0.0, z)[..., None]
        left, right, below, above = thing.label
        on = (at[..., 0] < 1e-6) & (at[..., 1] > left) & (at[..., 1] < right)
        colours[on & (at[..., 2] > below) & (at[..., 2] < above)] = 235
    return z, colours
