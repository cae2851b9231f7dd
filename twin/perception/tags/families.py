"""Which tags there are, and what they look like."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from twin.perception.opencv import opencv
from twin.perception.tags import tag36h11

FamilyName = Literal[
    "tag16h5", "tag25h9", "tag36h10", "tag36h11",
    "DICT_4X4_50", "DICT_4X4_100", "DICT_4X4_250", "DICT_4X4_1000",
    "DICT_5X5_50", "DICT_5X5_100", "DICT_5X5_250", "DICT_5X5_1000",
    "DICT_6X6_50", "DICT_6X6_100", "DICT_6X6_250", "DICT_6X6_1000",
    "DICT_7X7_50", "DICT_7X7_100", "DICT_7X7_250", "DICT_7X7_1000",
]  # fmt: skip
"""AprilTag's names, and OpenCV's of the dictionaries of ArUco."""


class Family(NamedTuple):
    """Tags that are told apart by their numbers."""

    dictionary: str
    """OpenCV's name of it."""
    side: int
    """Modules along each side, without the border."""
    total: int
    """Ids are below this."""
    half_turns: int = 0
    """How the family's authors turn what OpenCV draws: it has AprilTags upside down."""


_APRILTAG = {"16h5": (4, 30), "25h9": (5, 35), "36h10": (6, 2320), "36h11": (6, 587)}


def _family(name: str) -> Family:
    if name.startswith("tag"):
        kind = name.removeprefix("tag")
        return Family(f"DICT_APRILTAG_{kind}", *_APRILTAG[kind], half_turns=1)
    size, count = name.removeprefix("DICT_").split("_")
    return Family(name, int(size[0]), int(count))


FAMILIES: Mapping[str, Family] = {name: _family(name) for name in get_args(FamilyName)}
"""By name."""


def dictionary(family: str) -> Any:
    """Return OpenCV's dictionary of a family.

    Raises:
        ScenarioError: OpenCV is not installed.
    """
    aruco = opencv().aruco
    return aruco.getPredefinedDictionary(getattr(aruco, FAMILIES[family].dictionary))


@lru_cache(maxsize=256)
def modules(family: str, number: int) -> NDArray[np.bool_]:
    """Return which modules of a tag are white, rows from the top, without its black border.

    Raises:
        ScenarioError: OpenCV is not installed, and it is none of `tag36h11`.
    """
    known = FAMILIES[family]
    if family == "tag36h11":
        code = int(tag36h11.CODES[tag36h11.DIGITS * number :][: tag36h11.DIGITS], 16)
        places = np.arange(known.side**2 - 1, -1, -1)
        return ((code >> places) & 1).astype(bool).reshape(known.side, known.side)
    codes = dictionary(family)
    bits = codes.getBitsFromByteList(codes.bytesList[number : number + 1], known.side)
    return np.rot90(bits, 2 * known.half_turns).astype(bool)


def picture(family: str, number: int, pixels: int) -> NDArray[np.uint8]:
    """Return a tag with its black border and a white one around it, each a module wide.

    Args:
        family: One of `FAMILIES`.
        number: Its id.
        pixels: For each module.

    Raises:
        ScenarioError: OpenCV is not installed, and it is none of `tag36h11`.
    """
    grey = np.pad(np.pad(modules(family, number), 1), 1, constant_values=True).astype(np.uint8) * 255
    return grey.repeat(pixels, axis=0).repeat(pixels, axis=1)
