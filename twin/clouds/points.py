"""What all clouds have: fields, and x, y, z among them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from twin.errors import CloudError, shortened
from twin.geometry import Array, Pose3, matrix_from_quat_wxyz

Points = NDArray[Any]
"""A structured array, shape (n,) or (height, width)."""
XYZ = ("x", "y", "z")
_NORMAL = ("normal_x", "normal_y", "normal_z")


def make_points(values: Any, fields: Sequence[str] = XYZ, dtype: DTypeLike = np.float32) -> Points:
    """Return a cloud of one type from numbers of shape (n, fields).

    Raises:
        CloudError: There are more or fewer columns than fields.
    """
    values = np.asarray(values, dtype=dtype).reshape(len(values), -1 if len(values) else len(fields))
    if values.shape[1] != len(fields):
        raise CloudError(
            f"{values.shape[1]} numbers for each point; valid is {len(fields)}: {', '.join(fields)}"
        )
    points = np.zeros(len(values), [(name, values.dtype) for name in fields])
    for column, name in enumerate(fields):
        points[name] = values[:, column]
    return points


def coordinates(points: Points) -> Array:
    """Return x, y, z of all points, shape (n, 3) [m].

    Raises:
        CloudError: The cloud has none.
    """
    return _columns(points, XYZ)


def with_coordinates(points: Points, xyz: Array) -> Points:
    """Return a copy with other x, y, z, shape (n, 3) [m]."""
    return _with_columns(points, XYZ, xyz)


def is_measured(points: Points) -> NDArray[np.bool_]:
    """Return which points have finite x, y, z, shape (n,)."""
    return np.isfinite(coordinates(points)).all(axis=1)  # type: ignore[return-value]


def measured(points: Points) -> Points:
    """Return the points with finite x, y, z as a cloud that is not organised."""
    kept: Points = points.reshape(-1)[is_measured(points)]
    return kept


def transformed(points: Points, T_target_source: Pose3) -> Points:
    """Return a cloud in another frame: x, y, z are moved, normals turned, all other fields kept."""
    moved = with_coordinates(points, T_target_source.apply(coordinates(points)))
    if set(_NORMAL) <= set(points.dtype.names or ()):
        turn = matrix_from_quat_wxyz(T_target_source.quat_wxyz)
        moved = _with_columns(moved, _NORMAL, _columns(points, _NORMAL) @ turn.T)
    return moved


def packed(points: Points) -> Points:
    """Return the same fields one after another in memory, little-endian, without padding."""
    kinds = [(name, kind.newbyteorder("<")) for name, kind in scalar_fields(points.dtype)]
    dtype = np.dtype(kinds)
    if dtype == points.dtype and points.flags.c_contiguous:
        return points
    made = np.empty(points.shape, dtype)
    for name, _ in kinds:
        made[name] = points[name]
    return made


def scalar_fields(dtype: np.dtype[Any]) -> list[tuple[str, np.dtype[Any]]]:
    """Return names and types of fields; one of several numbers has a type with a shape.

    Raises:
        CloudError: It is no structure, or has other fields than numbers.
    """
    if dtype.names is None:
        raise CloudError(f"an array of {dtype} is no cloud; valid is one with fields, such as x, y, z")
    fields = [(name, dtype[name]) for name in dtype.names]
    for name, kind in fields:
        if kind.base.kind not in "iuf" or kind.base.itemsize > 8:
            raise CloudError(
                f"the field {name!r} is of type {kind.base}; valid are integers and floats of up to 8 bytes"
            )
    return fields


def _columns(points: Points, names: Sequence[str]) -> Array:
    have = points.dtype.names or ()
    for name in names:
        if name not in have or points.dtype[name].shape:
            raise CloudError(
                f"the cloud has no field {name!r} of one number; its fields: {shortened(have) or 'none'}"
            )
    made = np.empty((points.size, len(names)))
    for column, name in enumerate(names):
        made[:, column] = points[name].reshape(-1)
    return made


def _with_columns(points: Points, names: Sequence[str], values: Array) -> Points:
    made = points.copy()
    for column, name in enumerate(names):
        made[name] = values[:, column].reshape(points.shape)
    return made
