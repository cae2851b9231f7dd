"""The floor of a hall as a picture: slabs, lanes, hatched zones with names, soft shade beside what stands."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.font_manager import findfont
from matplotlib.ft2font import FT2Font
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, zoom

from twin.geometry import Array
from twin.models.shapes import Box
from twin.sim.looks.materials import as_bytes, smooth_noise
from twin.sim.scene import Rgba, StaticBody
from twin.warehouse.footprint import Rectangle
from twin.warehouse.shelf import Shelf, Zone

FINEST, MOST_PIXELS = 50.0, 1400
"""Pixels for each metre, and along the longer edge of the hall at most."""
_CONCRETE = (0.63, 0.635, 0.64)
_YELLOW: Rgba = (0.90, 0.72, 0.15, 1.0)
_INK = 0.93
"""How much of the light black letters swallow."""
_LANE, _LANE_GAP = 0.08, 0.22
"""Width of a line around a rack, and how far from it [m]."""
_SLAB, _JOINT = 4.0, 0.02
_STRIPE = 0.30
_SHADES = (0.08, 0.45)
"""How far the shade of what stands reaches, near its foot and farther out [m]."""
_LOW = 0.5
"""What begins higher above the floor throws no shade on it [m]."""


class _Floor:
    """A floor seen from above, north up, as a picture that grows."""

    def __init__(self, hall: Rectangle) -> None:
        self.scale = min(FINEST, MOST_PIXELS / max(hall.size_x, hall.size_y))
        self._rows, self._columns = round(hall.size_y * self.scale), round(hall.size_x * self.scale)
        x = hall.centre.x + ((np.arange(self._columns) + 0.5) / self._columns - 0.5) * hall.size_x
        y = hall.centre.y - ((np.arange(self._rows) + 0.5) / self._rows - 0.5) * hall.size_y
        self._x, self._y = x, y
        cloud = self._noise("floor", 1.0)
        grit = self._noise("floor grit", 0.04)
        slabs = np.sin(7.0 * np.floor(x / _SLAB) + 3.0 * np.floor(y / _SLAB)[:, None])
        joints = ((x % _SLAB) < _JOINT) | ((y % _SLAB) < _JOINT)[:, None]
        self.light = 1.0 + 0.03 * cloud + 0.025 * grit + 0.02 * slabs - 0.14 * joints
        self.colours = np.repeat(np.array([[_CONCRETE]]), self._rows, 0).repeat(self._columns, 1)
        self.wear = np.clip(0.88 + 0.25 * grit * cloud, 0.0, 1.0)

    def _noise(self, name: str, bump: float) -> Array:
        """Return noise with bumps of a size [m]."""
        rows, columns = (max(2, round(count / (bump * self.scale))) for count in (self._rows, self._columns))
        return smooth_noise(name, rows, columns, self._rows, self._columns)

    def window(self, area: Rectangle, margin: float = 0.0) -> Window:
        """Return the part of the picture that holds a rectangle and a margin [m]."""
        low, high = area.corners.min(axis=0) - 1.5 * margin, area.corners.max(axis=0) + 1.5 * margin
        columns = slice(*np.searchsorted(self._x, (low[0], high[0])).tolist())
        rows = slice(*np.searchsorted(-self._y, (-high[1], -low[1])).tolist())
        x, y = np.meshgrid(self._x[columns], self._y[rows])
        c, s = np.cos(area.centre.yaw), np.sin(area.centre.yaw)
        dx, dy = x - area.centre.x, y - area.centre.y
        return Window(area, (rows, columns), c * dx + s * dy, c * dy - s * dx)

    def paint(
        self, window: Window, where: Array | NDArray[np.bool_], colour: Rgba, opacity: float = 1.0
    ) -> None:
        """Cover a part of the floor, less where it is worn."""
        cover = (opacity * where * self.wear[window.at])[..., None]
        self.colours[window.at] += cover * (np.array(colour[:3]) - self.colours[window.at])

    def shade(self, standing: tuple[StaticBody, ...]) -> None:
        """Darken what is beside things that stand: the ceiling's light does not come from that side."""
        covered = np.zeros((self._rows, self._columns))
        for body in standing:
            for shape in body.shapes:
                pose = body.T_world_body @ shape.T_body_geometry
                if not (shape.solid and isinstance(shape.geometry, Box)):
                    continue
                if pose.xyz[2] - shape.geometry.size[2] / 2.0 < _LOW:
                    window = self.window(Rectangle(pose.to_pose2(), *shape.geometry.size[:2]))
                    covered[window.at][window.inside()] = 1.0
        coarse = covered[::2, ::2]
        near, far = (gaussian_filter(coarse, width * self.scale / 2.0, mode="nearest") for width in _SHADES)
        dark = np.repeat(np.repeat(0.55 * near + 0.45 * far, 2, axis=0), 2, axis=1)
        self.light *= np.clip(1.0 - dark[: self._rows, : self._columns], 0.3, 1.0)


class Window(NamedTuple):
    """A part of a floor's picture, with the coordinates of its pixels in the frame of a rectangle."""

    area: Rectangle
    at: tuple[slice, slice]
    x: Array
    y: Array

    def inside(self, margin: float = 0.0) -> NDArray[np.bool_]:
        """Return which pixels lie in the rectangle, or in one that is larger by a margin [m] on all sides."""
        wide, high = self.area.size_x / 2.0 + margin, self.area.size_y / 2.0 + margin
        return (np.abs(self.x) <= wide) & (np.abs(self.y) <= high)


def floor(
    hall: Rectangle, zones: tuple[Zone, ...], racks: tuple[Shelf, ...], standing: tuple[StaticBody, ...]
) -> NDArray[np.uint8]:
    """Return the picture of a floor, north up, shape (height, width, 3).

    Args:
        hall: What it covers, with its axes along those of the map.
        zones: Painted with stripes and their names.
        racks: With a line around each.
        standing: What throws a soft shade.
    """
    ground = _Floor(hall)
    for rack in racks:
        around = ground.window(rack.footprint, _LANE_GAP + _LANE)
        ground.paint(around, around.inside(_LANE_GAP + _LANE) & ~around.inside(_LANE_GAP), _YELLOW)
    for zone in zones:
        _zone(ground, zone)
    ground.shade(standing)
    return as_bytes(ground.colours * ground.light[..., None])


def _zone(ground: _Floor, zone: Zone) -> None:
    """Paint a zone: a tint, a hatched border where goods are put down, its name along its lower edge."""
    window = ground.window(zone.area)
    inside = window.inside()
    ground.paint(window, inside, zone.rgba, 0.12)
    hatched = zone.table is not None
    if hatched:
        stripes = ((window.x + window.y) / _STRIPE) % 1.0 < 0.5
        ground.paint(window, inside & ~window.inside(-_STRIPE) & stripes, zone.rgba)
    letters = text(zone.name.replace("_", " ").upper())
    width = 0.6 * zone.area.size_x
    pitch = width / letters.shape[1]
    height = letters.shape[0] * pitch
    left, top = -width / 2.0, height + _STRIPE * (1.0 + hatched) - zone.area.size_y / 2.0
    u = np.floor((window.x - left) / pitch).astype(np.intp)
    v = np.floor((top - window.y) / pitch).astype(np.intp)
    on = (u >= 0) & (u < letters.shape[1]) & (v >= 0) & (v < letters.shape[0])
    ground.paint(window, np.where(on, letters[v * on, u * on], 0.0), zone.rgba)


def sign(words: str, ground: Rgba = (0.95, 0.80, 0.15, 1.0)) -> NDArray[np.uint8]:
    """Return a sign with black letters and a black rim, twice as wide as high."""
    height, rim = 96, 4
    picture = np.full((height, 2 * height), _INK)
    picture[rim:-rim, rim:-rim] = 0.0
    letters = text(words)
    scale = min(0.6 * height / letters.shape[0], 1.7 * height / letters.shape[1])
    letters = zoom(letters, scale, order=1)
    top, left = (np.array(picture.shape) - letters.shape) // 2
    picture[top : top + letters.shape[0], left : left + letters.shape[1]] = _INK * letters
    return as_bytes((1.0 - picture[..., None]) * np.array(ground[:3]))


def text(words: str, pixels: int = 60) -> Array:
    """Return letters of about so many pixels, 1 where there is ink, shape (height, width)."""
    font = FT2Font(findfont("DejaVu Sans:bold"))
    font.set_size(pixels, 72)
    font.set_text(words)
    font.draw_glyphs_to_bitmap(antialiased=True)
    return np.asarray(font.get_image(), dtype=np.float64) / 255.0
