"""Materials by name: how each shines, and its texture, which is made when something is drawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from twin.files.kept import hash_of
from twin.geometry import Array
from twin.sim.looks.kept_pictures import kept_picture
from twin.sim.noise import NoiseStream

TEXELS = 128
"""Along each edge of a texture."""


def smooth_noise(name: str, rows: int, columns: int, height: int, width: int) -> Array:
    """Return noise from -1 to 1 with so many bumps down and across, shape (height, width), without a seam."""
    from scipy.ndimage import zoom  # only who paints needs it, and it takes as long as all textures

    grid = NoiseStream(0, f"texture/{name}").uniform(0, rows * columns).reshape(rows, columns) * 2.0 - 1.0
    return zoom(grid, (height / rows, width / columns), order=1, mode="grid-wrap", grid_mode=True)


def _concrete() -> Array:
    cloud = smooth_noise("concrete", 8, 8, TEXELS, TEXELS) + smooth_noise("grit", 64, 64, TEXELS, TEXELS)
    return _grey(0.93 + 0.035 * cloud)


def _plaster() -> Array:
    """Blocks of concrete with joints, under paint."""
    rows, columns = np.mgrid[0:TEXELS, 0:TEXELS] / TEXELS
    course = np.floor(2.0 * rows)
    joint = (np.abs((2.0 * rows) % 1.0 - 0.5) > 0.48) | (np.abs((columns + 0.5 * course) % 1.0 - 0.5) > 0.49)
    return _grey(0.98 - 0.07 * joint + 0.015 * smooth_noise("plaster", 48, 48, TEXELS, TEXELS))


def _wood() -> Array:
    """Planks along the texture's rows, with grain."""
    grain = 0.06 * smooth_noise("grain", 64, 3, TEXELS, TEXELS)
    plank = np.repeat(NoiseStream(0, "texture/planks").uniform(0, 4), TEXELS // 4)[:, None]
    gap = (np.arange(TEXELS) % (TEXELS // 4) < 2)[:, None]
    return _grey(0.86 + 0.12 * plank + grain - 0.35 * gap)


def _cardboard() -> Array:
    """Flutes that shimmer through, and fibres."""
    flutes = 0.02 * np.sin(2.0 * np.pi * np.arange(TEXELS) / 4.0)[None, :]
    return _grey(0.94 + flutes + 0.03 * smooth_noise("fibre", 48, 24, TEXELS, TEXELS))


def _board() -> Array:
    """Chipboard."""
    chips = smooth_noise("chips", 64, 64, TEXELS, TEXELS) * smooth_noise("chip size", 16, 16, TEXELS, TEXELS)
    return _grey(0.93 + 0.12 * chips)


def _grey(values: Array) -> Array:
    return np.repeat(values[..., None], 3, axis=2)


@dataclass(frozen=True, kw_only=True)
class Material:
    """How a surface looks; its colour is that of the shape."""

    texture: Callable[[], Array] | None = None
    """Returns what the shape's colour is multiplied by, from 0 to 1, shape (`TEXELS`, `TEXELS`, 3)."""
    tile: float = 1.0
    """Edge of the texture on the shape [m]."""
    specular: float = 0.15
    shininess: float = 0.3


PAINT = Material()
MATERIALS: Mapping[str, Material] = MappingProxyType(
    {
        "": PAINT,
        "steel": Material(specular=0.5, shininess=0.6),
        "plastic": Material(specular=0.4, shininess=0.5),
        "concrete": Material(texture=_concrete, tile=2.0, specular=0.1),
        "plaster": Material(texture=_plaster, tile=0.8, specular=0.05),
        "wood": Material(texture=_wood, tile=0.6, specular=0.05),
        "cardboard": Material(texture=_cardboard, tile=0.4, specular=0.02),
        "board": Material(texture=_board, tile=0.5, specular=0.1),
    }
)
"""By the name that a `Shape` gives."""


@cache
def texture(material: str) -> NDArray[np.uint8] | None:
    """Return the texture of a material, shape (`TEXELS`, `TEXELS`, 3); None: it has none."""
    make = MATERIALS[material].texture
    if make is None:
        return None
    return kept_picture(f"{hash_of(__file__)} {material}", lambda: as_bytes(make()))


def as_bytes(values: Array) -> NDArray[np.uint8]:
    """Return colours from 0 to 1 as bytes."""
    return np.rint(255.0 * np.clip(values, 0.0, 1.0)).astype(np.uint8)
