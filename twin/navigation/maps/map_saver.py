"""Writes maps as nav2_map_server's saver does: YAML beside PGM, PNG or BMP."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from twin.errors import MapError
from twin.files.writing import replaced
from twin.navigation.maps.map_image import write_image
from twin.navigation.maps.map_yaml import MODES, Mode
from twin.navigation.maps.occupancy_map import FREE, OCCUPIED, UNKNOWN, OccupancyMap

FORMATS = ("pgm", "png", "bmp")

# Trinary images hold three fixed levels, and these thresholds tell them apart; 205 is 19.6 % occupied.
_TRINARY_THRESHOLDS = "0.65", "0.196"


@dataclass(frozen=True, kw_only=True)
class SaveParameters:
    """How a map is saved; names and defaults are those of nav2_map_server.

    Raises:
        MapError: an unknown mode or format, or thresholds out of order.
    """

    mode: Mode = "trinary"
    image_format: str = ""
    """pgm, png or bmp; empty: png for scale, which needs transparency for unknown cells, else pgm."""
    occupied_thresh: float = 0.65
    """Cells from this share on are occupied."""
    free_thresh: float = 0.25
    """Cells up to this share are free."""

    def __post_init__(self) -> None:
        if self.mode not in MODES:
            raise MapError(f"map mode '{self.mode}'; valid is one of {', '.join(MODES)}")
        if self.image_format and self.image_format.lower() not in FORMATS:
            raise MapError(f"image format '{self.image_format}'; valid is one of {', '.join(FORMATS)}")
        if not 0.0 <= self.free_thresh < self.occupied_thresh <= 1.0:
            raise MapError(
                f"free threshold {self.free_thresh:g}, occupied threshold {self.occupied_thresh:g}; "
                "valid is 0 <= free < occupied <= 1"
            )

    @property
    def suffix(self) -> str:
        """Of the image's name."""
        return "." + (self.image_format.lower() or ("png" if self.mode == "scale" else "pgm"))


LOSSLESS_SCALE = SaveParameters(mode="scale", occupied_thresh=1.0, free_thresh=0.0)
"""Keeps each of the 102 values of a cell in an image that people can look at."""


def save_map(occupancy: OccupancyMap, path: Path, parameters: SaveParameters | None = None) -> Path:
    """Write a map and return the path of its image.

    Numbers are written with Nav2's three decimals where these are exact, else with as many as it takes: Nav2
    rounds a resolution of 0.0125 to 0.013.

    Args:
        occupancy: The map.
        path: The YAML file; the image gets its name.
        parameters: Defaults are Nav2's.

    Raises:
        MapError: a file cannot be written.
    """
    parameters = parameters or SaveParameters()
    name = path.name.removesuffix(".yaml").removesuffix(".yml")
    image = path.with_name(name + parameters.suffix)
    gray, alpha = _pixels(occupancy.data[::-1], parameters)
    if image.suffix != ".png":
        alpha = None
    occupied, free = _decimal(parameters.occupied_thresh), _decimal(parameters.free_thresh)
    if parameters.mode == "trinary":
        occupied, free = _TRINARY_THRESHOLDS
    x, y, yaw = occupancy.origin
    lines = (
        f"image: {image.name}",
        f"mode: {parameters.mode}",
        f"resolution: {_decimal(_shortest(occupancy.resolution))}",
        f"origin: [{_decimal(x)}, {_decimal(y)}, {yaw or 0!r}]",
        "negate: 0",
        f"occupied_thresh: {occupied}",
        f"free_thresh: {free}",
    )
    try:
        with replaced(image) as new:
            write_image(new, gray, alpha)
        with replaced(path) as new:
            new.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as fault:
        raise MapError(f"the map {path} cannot be written: {fault.strerror or fault}") from fault
    return image


def _pixels(
    data: NDArray[np.int8], parameters: SaveParameters
) -> tuple[NDArray[np.uint8], NDArray[np.uint8] | None]:
    unknown = data == UNKNOWN
    if parameters.mode == "raw":
        return np.where(unknown, 255, data).astype(np.uint8), None
    if parameters.mode == "scale":
        gray = np.where(unknown, 127, np.floor((100 - data.astype(np.float64)) * 2.55 + 0.5))
        return gray.astype(np.uint8), np.where(unknown, 0, 255).astype(np.uint8)
    gray = np.full(data.shape, 205, dtype=np.uint8)
    gray[(data >= FREE) & (data <= round(parameters.free_thresh * OCCUPIED))] = 254
    gray[data >= round(parameters.occupied_thresh * OCCUPIED)] = 0
    gray[unknown] = 205
    return gray, None


def _shortest(value: float) -> float:
    """Return the shortest decimal of what was single precision in a message: 0.05 for 0.05000000074505806."""
    single = np.float32(value)
    return float(str(single)) if float(single) == value else value


def _decimal(value: float) -> str:
    three = f"{value:.3f}"
    if float(three) == value or not math.isfinite(value):
        return three
    return repr(float(value))
