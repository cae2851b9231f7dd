"""How drivers of lidars lay out a point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

Driver = Literal["velodyne", "ouster", "livox"]
"""Whose fields a cloud has."""
_XYZI = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4")]


@dataclass(frozen=True, kw_only=True)
class Layout:
    """The fields of a point, and what they mean."""

    dtype: np.dtype[Any]
    layer: str
    """Field with the number of its layer, or of its laser."""
    time: str
    """Field that tells when it was measured."""
    per_second: float
    """Unit of that [1/s]."""
    from_stamp: bool = True
    """Whether times begin at the cloud's stamp, or at that of the clock."""
    from_above: bool = False
    """Whether layer 0 is the highest."""
    white: float = 100.0
    """Intensity of a white, diffuse surface that is met at a right angle."""


LAYOUTS: Mapping[Driver, Layout] = MappingProxyType(
    {
        # velodyne_driver's, 22 bytes.
        "velodyne": Layout(
            dtype=np.dtype([*_XYZI, ("ring", "<u2"), ("time", "<f4")]),
            layer="ring",
            time="time",
            per_second=1.0,
        ),
        # ouster_ros::Point, 48 bytes as PCL pads it.
        "ouster": Layout(
            dtype=np.dtype(
                {
                    "names": [*"xyz", "intensity", "t", "reflectivity", "ring", "ambient", "range"],
                    "formats": [*["<f4"] * 4, "<u4", "<u2", "<u2", "<u2", "<u4"],
                    "offsets": [0, 4, 8, 16, 20, 24, 26, 28, 32],
                    "itemsize": 48,
                }
            ),
            layer="ring",
            time="t",
            per_second=1e9,
            from_above=True,
        ),
        # LivoxPointXyzrtlt of livox_ros_driver2, 26 bytes; up to 150 of 255 are diffuse surfaces.
        "livox": Layout(
            dtype=np.dtype([*_XYZI, ("tag", "u1"), ("line", "u1"), ("timestamp", "<f8")]),
            layer="line",
            time="timestamp",
            per_second=1e9,
            from_stamp=False,
            white=150.0,
        ),
    }
)
