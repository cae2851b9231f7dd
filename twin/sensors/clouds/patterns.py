"""Where lidars look that never look twice at the same place: directions as functions of time alone."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Protocol

import numpy as np

from twin.geometry import Array

_TURN = 2.0 * math.pi
MOST_BYTES = 100_000_000
"""Of a file with a pattern; Livox's own have up to 20 MB."""


class Pattern(Protocol):
    """Directions by the number of the shot."""

    @property
    def lines(self) -> int:
        """Lasers that shoot in turns."""

    def directions(self, shots: Array, rate_hz: float) -> Array:
        """Return unit vectors, shape (n, 3): x ahead, z up.

        Args:
            shots: Numbers of shots since the time 0, shape (n,).
            rate_hz: Shots a second.
        """


@dataclass(frozen=True, kw_only=True)
class Rosette:
    """Two wedge prisms (Risley's) that turn at two speeds about the axis of one laser, which looks along x.

    To first order each bends the beam by a fixed angle towards where its thick side is (Marshall 1999, Risley
    prism scan patterns): the sum is a rose of which no petal falls onto another.
    """

    field_of_view: float
    """Full angle of its cone [rad]."""
    speeds_hz: tuple[float, float] = (7294.0 / 60.0, -4664.0 / 60.0)
    """Of the prisms [turns/s]; those of a Mid-40 (Brazeal, Wilkinson and Hochmair 2021)."""
    lines: int = 1

    def directions(self, shots: Array, rate_hz: float) -> Array:
        """Return unit vectors, shape (n, 3)."""
        # Whole turns are left out before they are multiplied: so times far from 0 are as exact.
        first, second = (np.modf(shots * (speed / rate_hz))[0] * _TURN for speed in self.speeds_hz)
        bend = self.field_of_view / 4.0
        left = bend * (np.cos(first) + np.cos(second))
        up = bend * (np.sin(first) + np.sin(second))
        away = np.hypot(left, up)
        share = np.sinc(away / math.pi)  # sin(away) / away
        return np.column_stack((np.cos(away), share * left, share * up))


@dataclass(frozen=True, kw_only=True)
class Spinning:
    """Lasers one above the other that spin about z while they swing up and down.

    Livox tells no formula of its Mid-360. This has what can be seen of its clouds: four lines, which a mirror
    turns over on the other side, the field of view, and that no turn is like the one before.
    """

    lowest: float
    """[rad]"""
    highest: float
    """[rad]"""
    lines: int
    spacing: float
    """Between two lines [rad]."""
    turns_hz: float
    swings_hz: float

    def directions(self, shots: Array, rate_hz: float) -> Array:
        """Return unit vectors, shape (n, 3)."""
        line = shots % self.lines - (self.lines - 1) / 2.0
        azimuth = -np.modf(shots * (self.turns_hz / rate_hz))[0] * _TURN
        swing = np.modf(shots * (self.swings_hz / rate_hz))[0] * _TURN
        reach = (self.highest - self.lowest - (self.lines - 1) * self.spacing) / 2.0
        elevation = (self.lowest + self.highest) / 2.0 + reach * np.cos(swing)
        return _unit(azimuth, elevation + line * self.spacing * np.sin(azimuth))


@dataclass(frozen=True, eq=False)
class Table:
    """Directions of a file, row by row, over and over again."""

    rows: Array
    """Unit vectors, shape (n, 3)."""
    lines: int = 4
    """As Livox's plugins count them."""

    def directions(self, shots: Array, rate_hz: float) -> Array:
        """Return unit vectors, shape (n, 3)."""
        return self.rows[(shots % len(self.rows)).astype(np.intp)]


PATTERNS: Mapping[str, Pattern] = MappingProxyType(
    {
        "mid40": Rosette(field_of_view=math.radians(38.4)),
        "mid70": Rosette(field_of_view=math.radians(70.4)),
        "mid360": Spinning(
            lowest=math.radians(-7.0),
            highest=math.radians(52.0),
            lines=4,
            spacing=math.radians(2.7),
            turns_hz=180.7,
            swings_hz=9.17,
        ),
    }
)
"""By the name of Livox's file; fields of view are those that Livox gives."""


def read_table(path: Path) -> Table:
    """Return the pattern of a file such as Livox's plugin has: time, azimuth and zenith [deg], below a title.

    Times are passed over, as in the plugin: rows are as far apart as shots.

    Raises:
        ValueError: It is none; in words that go on after the file's name.
    """
    try:
        if path.stat().st_size > MOST_BYTES:
            raise ValueError(f"has more than {MOST_BYTES // 1_000_000} MB")
        text = path.read_text("ascii")
    except (OSError, UnicodeDecodeError):
        raise ValueError("cannot be read as text") from None
    lines = text.splitlines()[1:]
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise ValueError("has no rows below its title")
    try:
        values = np.array([line.split(",") for line in lines], np.float64)
        wrong = ~(np.isfinite(values).all(axis=1) & (np.abs(values) < 1e9).all(axis=1))
        first = int(np.argmax(wrong)) if wrong.any() else -1
        if values.shape[1] != 3:
            first = 0
    except ValueError:
        first = next(number for number, line in enumerate(lines) if not _is_row(line))
    if first >= 0:
        raise ValueError(
            f"has '{lines[first][:40]}' in line {first + 2}; valid are three numbers: time, azimuth, zenith"
        )
    azimuth, zenith = np.radians(values[:, 1:]).T
    return Table(_unit(azimuth, math.pi / 2.0 - zenith))


def _is_row(line: str) -> bool:
    try:
        return len([float(word) for word in line.split(",")]) == 3
    except ValueError:
        return False


def _unit(azimuth: Array, elevation: Array) -> Array:
    level = np.cos(elevation)
    return np.column_stack((np.cos(azimuth) * level, np.sin(azimuth) * level, np.sin(elevation)))
