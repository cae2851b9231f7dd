"""Where values are in an array of MuJoCo's."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Indices = slice | NDArray[np.intp]


def indices(values: Iterable[int]) -> Indices:
    """Return indices as a slice if they follow each other: numpy takes that several times as fast."""
    found = np.fromiter(values, dtype=np.intp)
    if len(found) and (np.diff(found) == 1).all():
        return slice(int(found[0]), int(found[-1]) + 1)
    return found
