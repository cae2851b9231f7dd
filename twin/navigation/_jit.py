"""The one way this package compiles a function: numba, cached on disk, typed as the Python function.

Copy an array by a loop: to assign one to a slice compiles numba's message about shapes, too, for a second.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

from twin.navigation._kernel_cache import KernelCache

F = TypeVar("F", bound=Callable[..., Any])

_REORDER = {"reassoc", "contract", "nsz", "arcp"}
"""What may change in the last bit; that NaN and infinity are none of its business is not among it."""


def jit(function: F) -> F:
    """Return `function` compiled at its first call; the machine code is cached beside the source."""
    return _cached(numba.njit(function))


def fast_jit(function: F) -> F:
    """As `jit`, for loops over many numbers: sums may be taken in another order, and so eight at a time."""
    return _cached(numba.njit(error_model="numpy", fastmath=_REORDER)(function))


def _cached(dispatcher: Any) -> Any:
    """Do as `numba.njit(cache=True)` does, with a cache that sees what other files give to the function."""
    dispatcher._cache = KernelCache(dispatcher)
    return dispatcher
