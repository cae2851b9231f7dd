"""How a wide-angle camera projects: SDFormat's lenses, and the coefficients of CameraInfo that fit them.

Points are in the optical frame, and pixels counted, as in `twin.models.lens`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np

from twin.geometry import Array

Function = Literal["sin", "tan", "id"]
_FUNCTIONS: dict[Function, tuple[Callable[[Array], Array], Callable[[Array], Array]]] = {
    "sin": (np.sin, np.arcsin),
    "tan": (np.tan, np.arctan),
    "id": (np.asarray, np.asarray),
}
"""Each with its inverse."""
HIGHEST: dict[Function, float] = {"sin": math.pi / 2.0, "tan": math.pi / 2.0 - 1e-3, "id": math.inf}
"""Argument up to which each grows."""
_ODD = np.arange(1, 10, 2)
"""Powers of the angle in the model of Kannala and Brandt (2006)."""
_SAMPLES = 1000


class Mapping(NamedTuple):
    """How far from the middle a lens shows what is at an angle: r = c1 · fun(angle / c2 + c3)."""

    c1: float = 1.0
    c2: float = 1.0
    c3: float = 0.0
    fun: Function = "tan"

    def radius(self, angle: Array) -> Array:
        """Return r, without unit, of angles from the optical axis [rad]."""
        return self.c1 * _FUNCTIONS[self.fun][0](angle / self.c2 + self.c3)

    def angle(self, radius: Array) -> Array:
        """Return the angles [rad] that are shown at r; nan where none is."""
        with np.errstate(invalid="ignore"):
            return self.c2 * (_FUNCTIONS[self.fun][1](np.asarray(radius) / self.c1) - self.c3)

    @property
    def grows(self) -> bool:
        """Whether what is further from the axis is shown further from the middle."""
        return self.c1 > 0.0 and self.c2 > 0.0 and 0.0 <= self.c3 < min(HIGHEST[self.fun], math.pi / 2.0)

    @property
    def widest(self) -> float:
        """Angle from the optical axis up to which r grows [rad]."""
        return self.c2 * (HIGHEST[self.fun] - self.c3)


LENSES: dict[str, Mapping] = {
    "gnomonical": Mapping(1.0, 1.0, 0.0, "tan"),
    "stereographic": Mapping(2.0, 2.0, 0.0, "tan"),
    "equidistant": Mapping(1.0, 1.0, 0.0, "id"),
    "equisolid_angle": Mapping(2.0, 2.0, 0.0, "sin"),
    "orthographic": Mapping(1.0, 1.0, 0.0, "sin"),
}
"""By SDFormat's `<type>`."""


@dataclass(frozen=True, kw_only=True)
class WideLens:
    """A lens that may see what is beside the camera and behind it."""

    width: int
    """[pixels]"""
    height: int
    """[pixels]"""
    mapping: Mapping
    scale: tuple[float, float]
    """Pixels in a unit of r, along u and v."""
    centre: tuple[float, float]
    """Where the optical axis meets the image [pixels]."""
    cutoff_angle: float = math.pi / 2.0
    """From the optical axis, beyond which nothing is seen [rad], at most pi."""
    texture_size: int = 256
    """Edge of each of the pictures, 90 degrees wide, that are put together [pixels]."""

    @property
    def matrix(self) -> Array:
        """K of CameraInfo, shape (3, 3)."""
        fx, fy = self.focal_lengths
        return np.array([[fx, 0.0, self.centre[0]], [0.0, fy, self.centre[1]], [0.0, 0.0, 1.0]])

    @property
    def focal_lengths(self) -> tuple[float, float]:
        """Of K [pixels]."""
        slope = float(self._fit[0])
        return self.scale[0] * slope, self.scale[1] * slope

    @property
    def focal_length(self) -> float:
        """Of a pinhole that shows the middle of the image as large [pixels]."""
        return self.focal_lengths[1]

    @property
    def model(self) -> tuple[str, tuple[float, ...]]:
        """CameraInfo's distortion model and D, exact or the best that fit; a pinhole's if it is one."""
        if self._is_pinhole:
            return "plumb_bob", (0.0,) * 5
        return "equidistant", tuple((self._fit[1:] / self._fit[0]).tolist())

    @property
    def misfit(self) -> float:
        """How far off the model shows something at most [pixels]."""
        if self._is_pinhole:
            return 0.0
        angle = np.linspace(0.0, self.reach, _SAMPLES)
        off = (angle[:, None] ** _ODD) @ self._fit - self.mapping.radius(angle)
        return float(np.abs(off).max()) * max(self.scale)

    @cached_property
    def reach(self) -> float:
        """Largest angle from the optical axis that is seen [rad]."""
        u, v = (
            np.maximum(c, n - 1 - c) / s for c, n, s in zip(self.centre, self._size, self.scale, strict=True)
        )
        corner = float(self.mapping.angle(np.hypot(u, v)))
        return min(self.cutoff_angle, self.mapping.widest if math.isnan(corner) else corner)

    def project(self, points: Array) -> Array:
        """Return where points, shape (n, 3) [m], are seen: u, v, shape (n, 2) [pixels]; nan of the unseen."""
        beside = np.hypot(points[:, 0], points[:, 1])
        angle = np.arctan2(beside, points[:, 2])
        radius = np.where(
            angle <= min(self.cutoff_angle, self.mapping.widest), self.mapping.radius(angle), np.nan
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            side = np.where(beside[:, None] > 0.0, points[:, :2] / beside[:, None], 0.0)
        return radius[:, None] * side * self.scale + self.centre

    def directions(self) -> Array:
        """Return the unit vector to what each pixel sees, shape (height, width, 3); nan where nothing is."""
        u, v = ((np.arange(n) - c) / s for c, n, s in zip(self.centre, self._size, self.scale, strict=True))
        x, y = np.meshgrid(u, v)
        radius = np.hypot(x, y)
        angle = self.mapping.angle(radius)
        angle[~((angle >= 0.0) & (angle <= self.cutoff_angle))] = np.nan
        share = np.sin(angle) / np.maximum(radius, 1e-12)
        return np.stack((x * share, y * share, np.cos(angle)), axis=-1)

    def rays(self) -> Array:
        """Return the x and y on the plane z = 1 of what each pixel sees, shape (height, width, 2).

        What is beside the camera or behind it is not there: nan.
        """
        seen = self.directions()
        z = np.where(seen[..., 2:] > 0.0, seen[..., 2:], np.nan)
        return np.asarray(seen[..., :2] / z)

    @property
    def _is_pinhole(self) -> bool:
        return self.mapping[1:] == LENSES["gnomonical"][1:]

    @property
    def _size(self) -> tuple[int, int]:
        return self.width, self.height

    @cached_property
    def _fit(self) -> Array:
        """Factors of the odd powers of the angle whose sum is nearest to r, of all that is seen."""
        c1, c2, c3, fun = self.mapping
        if self._is_pinhole or (fun == "id" and c3 == 0.0):
            return np.array([c1 / c2, 0.0, 0.0, 0.0, 0.0])
        share = np.linspace(0.0, 1.0, _SAMPLES)
        factors = np.linalg.lstsq(share[:, None] ** _ODD, self.mapping.radius(share * self.reach))[0]
        return np.asarray(factors / self.reach**_ODD)
