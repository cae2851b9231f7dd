"""The coordinates inside a PointCloud2 of any layout, whatever other fields there are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.bridge.msgs import PointCloud2
from twin.errors import BridgeError, shortened
from twin.geometry import Pose3

_FLOATS = {7: "f4", 8: "f8"}
"""PointField.FLOAT32 and FLOAT64."""


def moved(cloud: PointCloud2, T_target_source: Pose3) -> PointCloud2:
    """Return a cloud with its x, y, z moved and all other fields kept; normals are not turned, as in tf2.

    Raises:
        BridgeError: there is no x, y, z of floating-point type, or less data than its sizes say.
    """
    data = np.array(cloud.data, dtype=np.uint8)
    fields = _coordinates(cloud, data)
    # NaN marks a point that was not measured, and stays NaN.
    points = np.stack([np.asarray(field, dtype=np.float64) for field in fields], axis=-1)
    out = T_target_source.apply(points.reshape(-1, 3)).reshape(points.shape)
    for axis, field in enumerate(fields):
        field[...] = out[..., axis]
    return replace(cloud, data=data)


def _coordinates(cloud: PointCloud2, data: np.ndarray) -> list[np.ndarray]:
    """Return x, y, z as views of the data, shape (height, width)."""
    if cloud.row_step < cloud.width * cloud.point_step or len(data) < cloud.height * cloud.row_step:
        raise BridgeError(
            f"the cloud has {len(data)} bytes; {cloud.height} rows of {cloud.width} points of "
            f"{cloud.point_step} bytes, {cloud.row_step} a row, need more"
        )
    order = ">" if cloud.is_bigendian else "<"
    layout = {field.name: field for field in cloud.fields}
    views = []
    for name in "xyz":
        field = layout.get(name)
        kind = None if field is None else _FLOATS.get(field.datatype)
        if field is None or kind is None:
            names = shortened([f.name for f in cloud.fields]) or "none"
            raise BridgeError(f"the cloud has no floating-point field {name!r}; its fields: {names}")
        dtype = np.dtype(order + kind)
        if field.offset + dtype.itemsize > cloud.point_step:
            raise BridgeError(f"the field {name!r} ends after the point's {cloud.point_step} bytes")
        if not cloud.width or not cloud.height:
            views.append(np.empty((cloud.height, cloud.width), dtype))
            continue
        views.append(
            np.ndarray(
                (cloud.height, cloud.width),
                dtype,
                data.data,
                field.offset,
                (cloud.row_step, cloud.point_step),
            )
        )
    return views
