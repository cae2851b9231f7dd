"""When the points of a cloud were measured, whichever driver tells it."""

from __future__ import annotations

import numpy as np

from twin.clouds.points import Points, scalar_fields

TIME_FIELDS = ("time", "t", "timestamp", "timestamps", "stamps", "offset_time")
"""Names of that field: Velodyne's, Ouster's, those of Hesai and Livox, and what else kiss-icp knows."""
_LONGEST_S = 2.0
"""A cloud takes less [s], unless its times are no seconds."""


def timed(points: Points, stamp: float) -> Points:
    """Return a cloud with a field `time`: seconds after its stamp; one that tells none as it is.

    Drivers tell seconds or nanoseconds, and since the stamp or since the clock began. Numbers with a fraction
    whose range is at most two seconds are seconds, all others nanoseconds; they count from what is nearer to
    the first of them. Where all are the same the cloud was measured at once, at its stamp.

    Args:
        points: With one of `TIME_FIELDS`.
        stamp: Of the cloud [s].
    """
    names = points.dtype.names or ()
    name = next((one for one in TIME_FIELDS if one in names), None)
    if name is None or (name == "time" and points.dtype[name] == np.float32):
        return points  # no double times are told in 32 bits: these are seconds after the stamp
    told = points[name].astype(np.float64)
    finite = told[np.isfinite(told)]
    if not len(finite):
        return points
    first, last = float(finite.min()), float(finite.max())
    is_s = points.dtype[name].kind == "f" and last - first <= _LONGEST_S
    unit = 1.0 if is_s else 1e-9
    begin = first * unit
    begin -= stamp if abs(begin - stamp) < abs(begin) else 0.0
    after = (told - first) * unit + (begin if last > first else 0.0)
    made = np.empty(
        points.shape, [*(one for one in scalar_fields(points.dtype) if one[0] != "time"), ("time", "<f8")]
    )
    for one in made.dtype.names or ():
        made[one] = after if one == "time" else points[one]
    return made
