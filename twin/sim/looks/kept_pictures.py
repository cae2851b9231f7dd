"""Pictures that are painted once for a user, not in each process: a floor takes half a second."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from twin.files.kept import keep, kept

Picture = NDArray[np.uint8]


def kept_picture(key: str, paint: Callable[[], Picture]) -> Picture:
    """Return what was painted under a key, else what `paint` returns, which is kept.

    Args:
        key: Of all that the picture depends on: what it shows, and the source of what paints it.
        paint: Returns the picture, shape (height, width, 3).
    """
    found = kept("pictures", key)
    try:
        packed = zlib.decompress(base64.b64decode(found["zlib"]))
        return np.frombuffer(packed, np.uint8).reshape(found["shape"])
    except (TypeError, KeyError, ValueError, zlib.error):  # never kept, or broken
        picture = paint()
    packed = zlib.compress(np.ascontiguousarray(picture).tobytes(), 1)
    keep("pictures", key, {"shape": picture.shape, "zlib": base64.b64encode(packed).decode()})
    return picture
