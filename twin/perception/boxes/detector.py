"""Finds boxes of any size and colour in pictures of depth, and tells where they are and how large."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from twin.geometry import Pose2, Pose3, quat_wxyz_from_yaw, wrap_angle
from twin.parameters import Interval, Metres, Positive
from twin.perception.boxes.columns import COARSE, Columns, next_measured, standing, tolerance
from twin.perception.boxes.picture import LevelView, Picture, level_view
from twin.perception.boxes.surface import Surface, find_surface
from twin.perception.boxes.walls import Wall, find_walls

_MAX_YAW = math.radians(45.0)
"""A face that is turned away farther than this is a side."""
_ASIDE = 0.04
"""What is beside a face is looked at for so far [m]."""
_SHADOW = 3.5
"""More pixels without depth are not those of an edge alone."""
_CORNER = math.radians(12.0)
"""How far the angle between front and side may be off a right one."""
_LEAST_COLUMNS = 8
"""A side that is seen in fewer does not tell how far back a box goes."""
_PARTLY = 0.5
"""Score of what is not wholly in sight, of 1."""


@dataclass(frozen=True, kw_only=True)
class Box:
    """A box that was seen."""

    front: Pose3
    """Of the middle of its front face in the base frame, x into the box, z up."""
    width: float
    """[m]"""
    height: float
    """Above what it stands on [m]."""
    depth: float | None
    """[m]; None: neither its top nor a side of it is in sight."""
    is_whole: bool
    """Whether left, right and upper edge of the face are in sight."""
    score: float
    """From 0 to 1: the share of the face that was measured, half as much if it is not whole."""

    @property
    def face(self) -> Pose2:
        """The front on the floor, x into the box."""
        return self.front.to_pose2()


class PictureDetector(ABC):
    """Finds what is to be grasped in one picture."""

    Config: ClassVar[type | None] = None
    """The class of its parameters: a frozen dataclass; None: it has none. If it has a field `camera`, that
    names the sensor whose pictures it gets."""
    wants_colours: ClassVar[bool] = False
    """Whether it gets colours with the depths."""

    def __init__(self, config: Any) -> None:
        """Take an object of its `Config`."""
        self.config = config

    @abstractmethod
    def detect(self, picture: Picture) -> Sequence[Box]:
        """Return the boxes, that nearest to straight ahead of the base first."""


@dataclass(frozen=True, kw_only=True)
class BoxesConfig:
    """What is looked at, and what counts as a box."""

    camera: str = ""
    """Name of the sensor that looks; empty: the robot's only one that makes such images."""
    min_range: Annotated[Metres, Positive] = 0.26
    """What is nearer to the camera is the gripper itself."""
    max_range: Annotated[Metres, Positive] = 1.8
    """What is farther away is not looked at."""
    max_drop: Annotated[Metres, Positive] = 0.5
    """How far the surface may be below the camera."""
    min_width: Annotated[Metres, Positive] = 0.06
    """A narrower face is an upright, or a part of something."""
    max_width: Annotated[Metres, Positive] = 0.8
    """A wider one is a wall."""
    min_height: Annotated[Metres, Positive] = 0.03
    """What is lower is not taken for a thing."""
    max_height: Annotated[Metres, Positive] = 0.6
    """So is what is higher."""
    min_score: Annotated[float, Interval(ge=0.0, le=1.0)] = 0.6
    """What scores less is told, but nothing to grasp at."""


class DepthBoxes(PictureDetector):
    """Finds boxes by depth: what touches another one's side, with the front flush, is one with it."""

    Config = BoxesConfig

    def detect(self, picture: Picture) -> Sequence[Box]:
        """Return the boxes that stand on the surface below the camera.

        Raises:
            ValueError: It is no picture.
        """
        config = self.config
        view = level_view(picture)
        surface = None if view is None else find_surface(view.xyz, config.max_drop)
        if view is None or surface is None:
            return []
        columns = standing(
            view, surface, near=config.min_range, far=config.max_range, max_height=config.max_height
        )
        walls = find_walls(view, columns, by_colour=self.wants_colours)
        boxes = [
            box
            for number in range(len(walls))
            if (box := _box(view, surface, columns, walls, number)) is not None
            and config.min_width <= box.width <= config.max_width
            and config.min_height <= box.height <= config.max_height
        ]
        return sorted(boxes, key=lambda box: abs(box.face.y))


class ColourDepthBoxes(DepthBoxes):
    """Finds boxes by depth, and tells those that touch apart by their colours."""

    wants_colours = True


@dataclass(frozen=True, kw_only=True)
class _Edge:
    """Where a face ends, to one side."""

    aside: float
    """The ray of it, -y / x."""
    is_seen: bool
    """Whether what is beyond it is not nearer, and hides it."""
    is_free: bool = False
    """Whether that is farther away: no other thing goes on from here."""


def _box(view: LevelView, surface: Surface, columns: Columns, walls: list[Wall], number: int) -> Box | None:
    """Return the box whose front is a wall; None if that is a side of one."""
    wall = walls[number]
    T_base_view = view.T_base_view.to_pose2()
    if abs(wrap_angle(wall.yaw + T_base_view.yaw)) > _MAX_YAW:
        return None
    left, right = (_edge(view, columns, walls, number, side) for side in (-1, 1))
    ends = wall.meets(left.aside), wall.meets(right.aside)
    middle = (ends[0] + ends[1]) / 2.0
    width = float(np.linalg.norm(ends[1] - ends[0]))
    on = wall.columns
    top_seen = float(np.mean(columns.is_top_seen[on]))
    height = float(np.median(columns.height[on]))
    face = columns.face[:, on]
    rows = columns.foot[on] - columns.top[on] + 1
    is_whole = left.is_seen and right.is_seen and top_seen > 0.5
    share = float(face.sum() / rows.sum()) * min(1.0, len(on) / max(int(np.ptp(on)) + 1, 1))
    foot = surface.slope @ middle + surface.offset
    front = Pose3(np.array((*middle, foot + height / 2.0)), quat_wxyz_from_yaw(wall.yaw))
    return Box(
        front=view.T_base_view @ front,
        width=width,
        height=height,
        depth=_depth(view, columns, walls, number),
        is_whole=is_whole,
        score=share * (1.0 if is_whole else _PARTLY),
    )


def _edge(view: LevelView, columns: Columns, walls: list[Wall], number: int, side: int) -> _Edge:
    """Return where a wall ends to the left (-1) or to the right (1)."""
    wall, x = walls[number], view.xyz[..., 0]
    column = int(wall.columns[0 if side < 0 else -1])
    rows = np.flatnonzero(columns.face[:, column])
    beyond = next_measured(x[rows], axis=1, step=side)[:, column]
    rows, beyond, of_all = rows[beyond >= 0], beyond[beyond >= 0], len(rows)
    # A stereo camera has no depth where the shift jumps: of two pixels at an edge, one is the face's.
    gap = float(np.median(np.abs(beyond - column))) if len(rows) else 0.0
    aside = float(view.aside[column]) + side * view.pixel * (1.5 if gap > 1.5 else 0.5)
    at = float(wall.meets(aside)[0])
    if 2 * len(rows) < of_all or not at > 0.0:
        return _Edge(aside=aside, is_seen=False)
    corner = _corner(walls, number, side)
    if corner is not None and abs(corner - aside) < 4.0 * view.pixel:
        aside = corner
    off = tolerance(at)
    goes_on = wall.offset / np.maximum(wall.normal[0] - wall.normal[1] * view.aside[beyond], 1e-6)
    # What is near casts a shadow to its left, in which the other view sees nothing: a face that ends at one
    # ends there.
    is_free = bool(np.median(x[rows, beyond] - goes_on) > off) or (side < 0 and gap > _SHADOW)
    # What hides it may show its own side first.
    ways = side * np.arange(int(_ASIDE / (view.pixel * at)) + 1)
    nearby = x[rows[:, None], np.clip(beyond[:, None] + ways, 0, x.shape[1] - 1)]
    nearest = np.min(np.nan_to_num(nearby, nan=np.inf), axis=1) - at
    return _Edge(aside=aside, is_seen=is_free or bool(np.median(nearest) > -off), is_free=is_free)


def _corner(walls: list[Wall], number: int, side: int) -> float | None:
    """Return the ray where the wall beside it meets a wall, at about a right angle; None: there is none."""
    if not 0 <= number + side < len(walls):
        return None
    wall, other = walls[number], walls[number + side]
    if abs(abs(wrap_angle(wall.yaw - other.yaw)) - math.pi / 2.0) > _CORNER:
        return None
    x, y = np.linalg.solve(np.stack((wall.normal, other.normal)), (wall.offset, other.offset))
    return float(-y / x) if x > 0.0 else None


def _depth(view: LevelView, columns: Columns, walls: list[Wall], number: int) -> float | None:
    """Return how far a box goes back, by its top or else by a side of it."""
    wall = walls[number]
    reach = columns.reach[wall.columns]
    if np.mean(np.isfinite(reach)) > 0.5:
        return float(np.nanmedian(reach) * wall.normal[0])
    for side in (-1, 1):
        corner = _corner(walls, number, side)
        other = walls[number + side] if corner is not None else wall
        if corner is None or len(other.columns) < _LEAST_COLUMNS:
            continue
        end = _edge(view, columns, walls, number + side, side)
        step = other.meets(end.aside) - other.meets(end.aside - side * view.pixel)
        if float(np.linalg.norm(step)) > COARSE:
            continue
        if end.is_free and abs(corner - view.aside[other.columns[0 if side > 0 else -1]]) < 4.0 * view.pixel:
            return float(np.linalg.norm(other.meets(end.aside) - other.meets(corner)))
    return None
