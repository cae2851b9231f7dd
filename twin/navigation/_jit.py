"""The one way this package compiles a function: numba, cached on disk, typed as the Python function.

Copy an array by a loop: to assign one to a slice compiles numba's message about shapes, too, for a second.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])

_REORDER = {"reassoc", "contract", "nsz", "arcp"}
"""What may change in the last bit; that NaN and infinity are none of its business is not among it."""


def jit(function: F) -> F:
    """Return `function` compiled at its first call; the machine code is cached beside the source."""
    return cast(F, numba.njit(cache=True)(function))


def fast_jit(function: F) -> F:
    """As `jit`, for loops over many numbers: sums may be taken in another order, and so eight at a time."""
    return cast(F, numba.njit(cache=True, error_model="numpy", fastmath=_REORDER)(function))
