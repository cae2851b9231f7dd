"""What `mj_multiRay` must not skip, and what it may: exact help for MuJoCo's own culling."""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.savings import ALL, Savings

_FLAT = 1e-12
"""Out of their plane, rays of unit length reach no farther than that."""
_FLAT_M = 1e-6
"""As far as rays reach out of their plane at the end of the world."""
_SLACK_M = 0.005
"""A shape so near to the plane of a fan is seen: so the plane of a robot that drives is looked at seldom."""
_MOVED_M, _TURNED = 0.03, 0.03
"""So far a link may move, and ends of unit vectors on it turn, before one looks anew what is beside its rays:
a robot that drives does so in a third of a turn of its lidar."""
_HIDDEN = mujoco.mjNGROUP - 1
"""A group that no ray sees."""
_FEW_BODIES = 12
"""Where rays fill no plane MuJoCo passes so many bodies by in less time than it takes to leave them out."""


class RayBounds:
    """While entered, `mj_multiRay` misses nothing of the bodies that rays see, and skips the others whole.

    By itself it skips a body whose bounding sphere a ray misses, but puts that sphere at the centre of mass
    plus the volume's offset from it without turning the offset with the body (engine_ray.c, mju_singleRay;
    seen in MuJoCo 3.17). A sphere around the centre of mass itself, larger by the offset, holds the body in
    every attitude. Collisions need the volumes as they are: there a larger one costs time.
    """

    def __init__(self, model: mujoco.MjModel, groups: NDArray[np.uint8], savings: Savings = ALL) -> None:
        """Bind to a model; `groups` of the shapes that rays see, shape (mjNGROUP,)."""
        seen = np.bincount(model.geom_bodyid, weights=_are_seen(model, groups), minlength=model.nbody)
        self._counts = model.body_geomnum
        self._all = self._counts.copy()
        self._seen = np.where((seen == 0) & savings.plane_of_rays, 0, self._all)
        roots = model.body_bvhadr[model.body_bvhadr >= 0]
        offset = np.linalg.norm(model.bvh_aabb[roots, :3], axis=1)
        self._roots = roots[offset > 0.0]
        self._volumes = model.bvh_aabb
        self._exact = model.bvh_aabb[self._roots]
        half = self._exact[:, 3:]
        growth = 1.0 + offset[offset > 0.0] / np.linalg.norm(half, axis=1)
        self._safe = np.hstack((np.zeros_like(half), half * growth[:, None]))

    def __enter__(self) -> None:
        self._volumes[self._roots] = self._safe
        self._counts[:] = self._seen

    def __exit__(self, *_: object) -> None:
        self._volumes[self._roots] = self._exact
        self._counts[:] = self._all


class BodiesInReach:
    """While entered, `mj_multiRay` skips bodies out of reach, off the plane of a flat fan, beside a bundle.

    It does so by itself, but ray by ray: with many robots that is most of what a scan costs.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        directions: Array,
        groups: NDArray[np.uint8],
        reach: float,
        savings: Savings,
    ) -> None:
        """Bind to a model.

        Args:
            model: The compiled world.
            directions: As of `FanSlice`.
            groups: Of the shapes that rays see, shape (mjNGROUP,).
            reach: Of the rays [m].
            savings: What is not done over again.
        """
        self._normal = _normal(directions)
        self._sides: Array | None = None
        self.aim(directions)
        is_body = _are_seen(model, groups) & (model.geom_bodyid > 0)
        pays = self._normal is not None or len(np.unique(model.geom_bodyid[is_body])) > _FEW_BODIES
        self._geoms = np.flatnonzero(is_body & pays & savings.plane_of_rays)
        is_plane = model.geom_type[self._geoms] == mujoco.mjtGeom.mjGEOM_PLANE
        self._radius = np.where(is_plane, math.inf, model.geom_rbound[self._geoms])
        self._reach_squared = (reach + self._radius) ** 2
        self._bodies, self._first = np.unique(model.geom_bodyid[self._geoms], return_index=True)
        self._counts = model.body_geomnum
        self._all = self._counts[self._bodies]
        self._now = self._all

    def aim(self, directions: Array) -> None:
        """Take other rays, which fill no plane."""
        self._sides = None if self._normal is not None else _sides(directions)

    def look(self, place: Array, turn: Array, data: mujoco.MjData) -> None:
        """Find what the rays of a link at `place`, shape (3,), with attitude `turn`, (3, 3), may hit now."""
        if not len(self._geoms):
            return
        away = data.geom_xpos[self._geoms] - place
        hit = np.einsum("ij,ij->i", away, away) <= self._reach_squared
        if self._normal is not None:
            hit &= np.abs(away @ (turn @ self._normal)) <= self._radius + _FLAT_M
        if self._sides is not None:
            inward = self._sides @ turn.T @ away.T
            hit &= inward.min(axis=0) >= -self._radius - _SLACK_M
        self._now = np.where(np.logical_or.reduceat(hit, self._first), self._all, 0)

    def __enter__(self) -> None:
        if self._now is not self._all:
            self._counts[self._bodies] = self._now

    def __exit__(self, *_: object) -> None:
        if self._now is not self._all:
            self._counts[self._bodies] = self._all


class _Scenery:
    """While entered, `mj_multiRay` does not see the scenery that `look` found to be out of the way.

    It tests every ray against every shape.
    """

    def __init__(self, model: mujoco.MjModel, groups: NDArray[np.uint8], is_sliced: bool) -> None:
        """Bind to a model.

        Args:
            model: The compiled world.
            groups: Of the shapes that rays see, shape (mjNGROUP,).
            is_sliced: If not, all is seen.
        """
        self._groups = model.geom_group
        bounded = (model.geom_bodyid == 0) & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE)
        is_sliced = is_sliced and not groups[_HIDDEN]
        self._geoms = np.flatnonzero(_are_seen(model, groups) & bounded & is_sliced)
        self._centre, self._half = _boxes(model, self._geoms)
        self._shown = self._groups[self._geoms]
        self._now = self._shown

    def __enter__(self) -> None:
        if self._now is not self._shown:
            self._groups[self._geoms] = self._now

    def __exit__(self, *_: object) -> None:
        if self._now is not self._shown:
            self._groups[self._geoms] = self._shown


class FanSlice(_Scenery):
    """Leaves out the scenery that the plane of a flat fan misses: most of it is above or below a lidar."""

    def __init__(
        self,
        model: mujoco.MjModel,
        directions: Array,
        groups: NDArray[np.uint8],
        savings: Savings = ALL,
    ) -> None:
        """Bind to a model.

        Args:
            model: The compiled world.
            directions: Unit vectors in the link's frame, shape (n, 3); where they fill no plane, all is seen.
            groups: Of the shapes that rays see, shape (mjNGROUP,).
            savings: What is not done over again.
        """
        normal = _normal(directions)
        super().__init__(model, groups, normal is not None and savings.plane_of_rays)
        self._normal = np.zeros(3) if normal is None else normal
        """Of the plane, in the link's frame."""
        self._radius = float(np.linalg.norm(np.abs(self._centre) + self._half, axis=1).max(initial=0.0))
        self._plane: tuple[Array, float] = np.zeros(3), math.inf
        """Normal and height [m] when it was looked at last, in the world."""

    def look(self, place: Array, turn: Array) -> None:
        """Find what the plane of a fan at `place`, shape (3,), with attitude `turn`, (3, 3), meets now."""
        if not len(self._geoms):
            return
        normal = turn @ self._normal
        height = float(place @ normal)
        turned = math.dist(normal, self._plane[0])
        if self._radius * turned + abs(height - self._plane[1]) < _SLACK_M / 2.0:
            return
        self._plane = normal, height
        reach = self._half @ np.abs(normal) + _SLACK_M
        self._now = np.where(np.abs(self._centre @ normal - height) > reach, _HIDDEN, self._shown)


class PyramidSlice(_Scenery):
    """Leaves out the scenery beside a bundle of rays, such as a part of what a spinning lidar sees.

    It looks beside all bundles of a link together, with room for the link to move and turn until it looks
    again: to look for each by itself takes a tenth of the time of casting it in an empty room.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        bundles: Sequence[Array],
        groups: NDArray[np.uint8],
        savings: Savings = ALL,
    ) -> None:
        """Bind to a model.

        Args:
            model: The compiled world.
            bundles: Unit vectors of each in the link's frame, shape (n, 3). One that goes apart too far sees
                everything; all of them do if rays of one fill a plane.
            groups: Of the shapes that rays see, shape (mjNGROUP,).
            savings: What is not done over again.
        """
        is_sliced = all(_normal(bundle) is None for bundle in bundles)
        super().__init__(model, groups, is_sliced and savings.plane_of_rays)
        self._sides = np.zeros((0, 3))
        self._boxes = np.vstack((self._centre.T, self._half.T, np.ones(len(self._geoms))))
        self._rows = np.tile(self._shown, (len(bundles), 1))
        self._pose: tuple[Array, Array] | None = None
        """Place and attitude when it looked last."""
        self.aim(bundles)

    def aim(self, bundles: Sequence[Array]) -> None:
        """Take as many other bundles, which may fill a plane or go apart as they like."""
        if len(self._geoms):
            self._sides, self._pose = np.concatenate([_sides(bundle, _TURNED) for bundle in bundles]), None

    def look(self, number: int, place: Array, turn: Array) -> None:
        """Find what a bundle holds now.

        Args:
            number: Of the bundle.
            place: Of the link, shape (3,).
            turn: Of the link, shape (3, 3).
        """
        if not len(self._geoms):
            return
        attitude = turn.ravel()
        if (
            self._pose is None
            or math.dist(place, self._pose[0]) > _MOVED_M
            or math.dist(attitude, self._pose[1]) > _TURNED
        ):
            self._pose = place.copy(), attitude.copy()
            sides = self._sides @ turn.T
            least = sides @ place - _MOVED_M - _SLACK_M
            # How far the corner of a box that is farthest inward of a side is inside of it.
            inside = np.hstack((sides, np.abs(sides), -least[:, np.newaxis])) @ self._boxes
            is_beside = inside.reshape(len(self._rows), 4, -1).min(axis=1) < 0.0
            self._rows = np.where(is_beside, _HIDDEN, self._shown)
        self._now = self._rows[number]


def _sides(directions: Array, turned: float = 0.0) -> Array:
    """Return inward normals of a pyramid that holds rays, shape (4, 3); 0: they go apart too far for one.

    It holds them even if their ends, at a distance of 1, were `turned` so far.
    """
    axis = directions.mean(axis=0)
    length = float(np.linalg.norm(axis))
    if length < 0.1:
        return np.zeros((4, 3))
    axis /= length
    across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    along = directions @ axis
    if along.min() < 0.1:
        return np.zeros((4, 3))
    sides = []
    for side in (across / np.linalg.norm(across), np.cross(axis, across / np.linalg.norm(across))):
        slopes = directions @ side / along
        sides += [side - slopes.min() * axis, slopes.max() * axis - side]
    unit = np.array([side / np.linalg.norm(side) for side in sides])
    # What was inside is then outside by `turned` at most, and at least so far along the axis.
    leant = unit + turned / (along.min() - turned) * axis
    return leant / np.linalg.norm(leant, axis=1)[:, np.newaxis]


def _normal(directions: Array) -> Array | None:
    """Return the normal of the plane in which unit vectors, shape (n, 3), lie; None if there is none."""
    normal: Array = np.linalg.eigh(directions.T @ directions)[1][:, 0]
    return normal if np.abs(directions @ normal).max() < _FLAT else None


def _are_seen(model: mujoco.MjModel, groups: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return for each shape whether rays see its group."""
    return groups[np.clip(model.geom_group, 0, mujoco.mjNGROUP - 1)] > 0


def _boxes(model: mujoco.MjModel, geoms: NDArray[np.intp]) -> tuple[Array, Array]:
    """Return centres and half sizes, shape (n, 3), of axis-aligned boxes around the world body's shapes."""
    rows = np.zeros((len(geoms), 9))
    for row, quat in zip(rows, model.geom_quat[geoms], strict=True):
        mujoco.mju_quat2Mat(row, quat)
    turns = rows.reshape(-1, 3, 3)
    centre, half = np.hsplit(model.geom_aabb[geoms], 2)
    placed = model.geom_pos[geoms] + np.einsum("nij,nj->ni", turns, centre)
    return placed, np.einsum("nij,nj->ni", np.abs(turns), half)
