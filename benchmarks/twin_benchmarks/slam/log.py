"""Recorded lidar logs: scans, odometry and a reference, as npz archives."""

from __future__ import annotations

import io
import math
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twin.errors import MapError
from twin.files.reading import read_bytes
from twin.geometry import Array

SPEED = 1.0
"""Of a robot whose log has no usable times [m/s]; faster than most of these drove."""
FAN = math.pi
"""The angle that the beams cover [rad]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SlamLog:
    """A log; all arrays in the order of its scans."""

    name: str
    ranges: Array
    """Readings [m], shape (n, beams); NaN where nothing was seen."""
    angles: Array
    """Their bearings [rad], shape (beams,)."""
    odometry: Array
    """Poses x [m], y [m], yaw [rad] of the wheels' odometry, shape (n, 3)."""
    reference: Array
    """Poses that the log's author has computed, shape (n, 3)."""
    duration: float
    """Of the drive [s]."""
    timed: bool
    """Whether the duration was recorded; otherwise it is that of a robot of 1 m/s."""

    @property
    def length(self) -> float:
        """Of the path [m], by odometry."""
        return float(np.hypot(*np.diff(self.odometry[:, :2], axis=0).T).sum())


def load_log(path: Path) -> SlamLog:
    """Read an npz archive of `ranges`, shape (n, beams) in whole cm, and `t_odom_ref`, shape (n, 7).

    The seven are time [s], pose by odometry, and pose of reference. The largest reading of a log, and what
    comes within half a percent of it, is the lidar's way to say that it saw nothing.

    Raises:
        MapError: the file cannot be read or is no such archive.
    """
    try:
        with np.load(io.BytesIO(read_bytes(path)), allow_pickle=False) as archive:
            centimetres = np.asarray(archive["ranges"], dtype=np.float64)
            columns = np.asarray(archive["t_odom_ref"], dtype=np.float64)
    except OSError as fault:
        raise MapError(f"{path}: {fault.strerror or 'cannot be read'}; valid is a lidar log (.npz)") from None
    except (ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
        raise MapError(
            f"{path}: is no npz archive with ranges and t_odom_ref; valid is a lidar log"
        ) from None
    beams = centimetres.shape[1] if centimetres.ndim == 2 else 0
    if beams < 3 or columns.shape != (len(centimetres), 7) or len(columns) < 2:
        shapes = f"ranges {centimetres.shape} and t_odom_ref {columns.shape}"
        raise MapError(f"{path}: has {shapes}; valid is (n, beams) and (n, 7) with n at least 2")
    if not np.all(np.isfinite(columns)):
        raise MapError(f"{path}: t_odom_ref has values that are no numbers; valid are finite numbers")
    # Of an odd number the middle one looks ahead; of an even number, the beam at the fan's end is left out.
    angles: Array = np.arange(beams, dtype=np.float64) * (FAN / (beams - beams % 2)) - 0.5 * FAN
    nothing = (centimetres >= 0.995 * centimetres.max()) | (centimetres <= 0.0)
    odometry = columns[:, 1:4]
    duration, timed = _duration(columns[:, 0], odometry)
    return SlamLog(
        name=path.stem,
        ranges=np.where(nothing, np.nan, centimetres / 100.0),
        angles=angles,
        odometry=odometry,
        reference=columns[:, 4:7],
        duration=duration,
        timed=timed,
    )


def _duration(times: Array, odometry: Array) -> tuple[float, bool]:
    """Return the duration [s], and whether the log's times tell it: some logs have them rounded."""
    steps = np.diff(times)
    if np.all(steps >= 0.0) and np.count_nonzero(steps) > 0.5 * len(steps):
        return float(times[-1] - times[0]), True
    return float(np.hypot(*np.diff(odometry[:, :2], axis=0).T).sum()) / SPEED, False
