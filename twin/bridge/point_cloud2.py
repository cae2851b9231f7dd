"""sensor_msgs/PointCloud2 and numpy, as `sensor_msgs_py.point_cloud2` has it: fields in any order, padding.

Where that takes an organised cloud for an array of shape (width, height), it is (height, width) here, as its
bytes are.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.lib.recfunctions import structured_to_unstructured
from numpy.typing import ArrayLike, NDArray

from twin.bridge.msgs import Header, PointCloud2, PointField
from twin.clouds.points import XYZ, Points, is_measured, make_points, packed, scalar_fields
from twin.errors import BridgeError, CloudError, shortened

_CODES = ("i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8")
_DATATYPES = {code: number for number, code in enumerate(_CODES, 1)}
"""PointField.INT8 to FLOAT64."""
_MOST_NUMBERS = 1 << 16
"""Of a point."""


def dtype_from_fields(
    fields: Iterable[PointField], point_step: int | None = None, *, is_bigendian: bool = False
) -> np.dtype[Any]:
    """Return the structure of a point.

    A field of several numbers becomes as many fields: `name_0`, `name_1`; without a name: `unnamed_field_0`.

    Args:
        fields: As the message has them.
        point_step: Bytes of a point; None: up to the end of its last field.
        is_bigendian: Order of the bytes.

    Raises:
        BridgeError: Two fields have the same name, or one has an unknown type or ends after the point.
    """
    order = ">" if is_bigendian else "<"
    names, formats, offsets = list[str](), list[np.dtype[Any]](), list[int]()
    for index, field in enumerate(fields):
        if not 1 <= field.datatype <= len(_CODES):
            raise BridgeError(
                f"the field {field.name!r} has datatype {field.datatype}; valid is 1 (INT8) to 8 (FLOAT64)"
            )
        kind = np.dtype(order + _CODES[field.datatype - 1])
        name = field.name or f"unnamed_field_{index}"
        if not 0 < field.count <= _MOST_NUMBERS - len(names):
            raise BridgeError(f"the field {name!r} has {field.count} numbers; valid is at least 1, and few")
        for number in range(field.count):
            names.append(name if field.count == 1 else f"{name}_{number}")
            formats.append(kind)
            offsets.append(field.offset + number * kind.itemsize)
    end = max((offset + kind.itemsize for offset, kind in zip(offsets, formats, strict=True)), default=0)
    if point_step is not None and end > point_step:
        last = max(range(len(names)), key=lambda i: offsets[i] + formats[i].itemsize)
        raise BridgeError(f"the field {names[last]!r} ends after the point's {point_step} bytes")
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise BridgeError(f"the cloud has two fields {twice!r}")
    size = end if point_step is None else point_step
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size})


def points_in(cloud: PointCloud2, data: NDArray[np.uint8]) -> Points:
    """Return a cloud as a view of its data, shape (height, width).

    Raises:
        BridgeError: There is less data than the sizes say, or the fields are not those of a point.
    """
    if cloud.row_step < cloud.width * cloud.point_step or len(data) < cloud.height * cloud.row_step:
        raise BridgeError(
            f"the cloud has {len(data)} bytes; {cloud.height} rows of {cloud.width} points of "
            f"{cloud.point_step} bytes, {cloud.row_step} a row, need more"
        )
    dtype = dtype_from_fields(cloud.fields, cloud.point_step, is_bigendian=bool(cloud.is_bigendian))
    if not cloud.width or not cloud.height or not dtype.itemsize:
        return np.empty((0, 0), dtype)
    shape, steps = (cloud.height, cloud.width), (cloud.row_step, cloud.point_step)
    return np.ndarray(shape, dtype, data.data, 0, steps)


def read_points(
    cloud: PointCloud2,
    field_names: Sequence[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[int] | NDArray[np.integer[Any]] | None = None,
    reshape_organized_cloud: bool = False,
) -> Points:
    """Return the points of a cloud as a structured array, shape (n,).

    Args:
        cloud: The message.
        field_names: Only these; None: all.
        skip_nans: Leave points out that have a NaN in one of these; those of a dense cloud are not looked at.
        uvs: Indices of the points that are wanted; None: all.
        reshape_organized_cloud: Return an organised cloud in shape (height, width).

    Raises:
        BridgeError: There is no such field or point, or the message is not well-formed.
    """
    grid = points_in(cloud, np.asarray(cloud.data, dtype=np.uint8))
    names = grid.dtype.names or ()
    if field_names is not None:
        for name in field_names:
            if name not in names:
                raise BridgeError(
                    f"the cloud has no field {name!r}; its fields: {shortened(names) or 'none'}"
                )
        grid = grid[list(field_names)]
    points: Points = grid.reshape(-1)
    if cloud.is_bigendian != (sys.byteorder == "big"):
        points = points.astype(points.dtype.newbyteorder("="))
    if skip_nans and not cloud.is_dense:
        points = points[~np.any([np.isnan(points[name]) for name in points.dtype.names or ()], axis=0)]
    if uvs is not None:
        chosen = uvs if isinstance(uvs, np.ndarray) else np.fromiter(uvs, dtype=np.intp)
        if len(chosen) and not (-len(points) <= chosen.min() and chosen.max() < len(points)):
            raise BridgeError(
                f"uvs go from {chosen.min()} to {chosen.max()}; the cloud has {len(points)} points"
            )
        points = points[chosen]
    if reshape_organized_cloud and cloud.height > 1 and len(points) == cloud.height * cloud.width:
        points = points.reshape(cloud.height, cloud.width)
    return points


def read_points_numpy(
    cloud: PointCloud2,
    field_names: Sequence[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[int] | NDArray[np.integer[Any]] | None = None,
    reshape_organized_cloud: bool = False,
) -> NDArray[Any]:
    """Return the points of a cloud as a plain array, shape (n, fields); see `read_points`.

    Raises:
        BridgeError: The fields are of several types; name some of one type.
    """
    points = read_points(cloud, field_names, skip_nans, uvs, reshape_organized_cloud)
    kinds = {points.dtype[name] for name in points.dtype.names or ()}
    if len(kinds) > 1:
        raise BridgeError(f"the fields are of several types: {points.dtype}; name some of one type")
    return structured_to_unstructured(points)


def create_cloud(
    header: Header, fields: Sequence[PointField], points: ArrayLike, step: int | None = None
) -> PointCloud2:
    """Return a message of points.

    Args:
        header: Stamp and frame.
        fields: Of a point.
        points: A structured array of just these fields, shape (n,) or (height, width), or numbers of shape
            (n, fields).
        step: Bytes of a point; None: up to the end of its last field.

    Raises:
        BridgeError: The points are not of these fields.
    """
    dtype = dtype_from_fields(fields, step)
    values = np.asarray(points)
    if values.dtype.names is None:
        names = dtype.names or ()
        rows = values if values.size else np.zeros((0, len(names)))
        if rows.ndim not in (2, 3) or rows.shape[-1] != len(names):
            raise BridgeError(f"the points are numbers of shape {rows.shape}; valid is (n, {len(names)})")
        values = np.zeros(rows.shape[:-1], dtype)
        for column, name in enumerate(names):
            values[name] = rows[..., column]
    elif values.dtype != dtype:
        raise BridgeError(f"the points are of {values.dtype}; the fields are those of {dtype}")
    if values.ndim not in (1, 2):
        raise BridgeError(f"the points have shape {values.shape}; valid is (n,), or (height, width)")
    height, width = values.shape if values.ndim == 2 else (1, len(values))
    return PointCloud2(
        header=header,
        height=height,
        width=width,
        fields=list(fields),
        is_bigendian=False,
        point_step=dtype.itemsize,
        row_step=dtype.itemsize * width,
        data=np.frombuffer(values.tobytes(), dtype=np.uint8),
        is_dense=False,
    )


def create_cloud_xyz32(header: Header, points: ArrayLike) -> PointCloud2:
    """Return a message of points with x, y, z as FLOAT32; shape (n, 3)."""
    return create_cloud(header, fields_of(make_points(()).dtype), points)


def cloud_of(header: Header, points: Points) -> PointCloud2:
    """Return a message of a structured array, whose fields become the message's.

    Raises:
        BridgeError: A field has a type that messages lack.
    """
    plain = packed(points)
    message = create_cloud(header, fields_of(plain.dtype), _parted(plain))
    message.is_dense = set(XYZ) <= set(plain.dtype.names or ()) and bool(is_measured(plain).all())
    return message


def fields_of(dtype: np.dtype[Any]) -> list[PointField]:
    """Return the fields of a message that a structure's are.

    Raises:
        BridgeError: A message has no such type, as 64-bit integers.
    """
    fields = []
    try:
        kinds = scalar_fields(dtype)
    except CloudError as fault:
        raise BridgeError(str(fault)) from None
    for name, kind in kinds:
        number = _DATATYPES.get(kind.base.str[1:])
        if number is None:
            raise BridgeError(
                f"the field {name!r} is of {kind.base}; a message has integers of up to 4 bytes"
            )
        offset = dtype.fields[name][1] if dtype.fields is not None else 0
        fields.append(PointField(name, offset, number, int(np.prod(kind.shape, dtype=int))))
    return fields


def _parted(points: Points) -> Points:
    """Return packed points with a field for each number, as `dtype_from_fields` has it."""
    return points.view(dtype_from_fields(fields_of(points.dtype)))
