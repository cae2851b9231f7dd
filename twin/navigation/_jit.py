"""The one way this package compiles a function: numba, cached on disk, typed as the Python function.

Copy an array by a loop: to assign one to a slice compiles numba's message about shapes, too, for a second.
Take sums and extrema of an array by a loop, too: numba's own load SciPy's linear algebra, for 0.2 s of CPU.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])

_REORDER = frozenset({"reassoc", "contract", "nsz", "arcp"})
"""What may change in the last bit; that NaN and infinity are none of its business is not among it."""


class Kernel:
    """A function that is compiled, or loaded from the disk, at its first call; so is numba."""

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        functools.update_wrapper(self, function)
        self._function, self._options = function, options

    def __call__(self, *args: Any) -> Any:
        return self.dispatcher(*args)

    @functools.cached_property
    def dispatcher(self) -> Any:
        """What numba makes of the function, with a cache that sees what other files give to it."""
        import numba

        from twin.navigation._kernel_cache import KernelCache

        dispatcher: Any = numba.njit(**self._options)(self._function)
        dispatcher._cache = KernelCache(dispatcher)
        return dispatcher


def jit(function: F) -> F:
    """Return `function` compiled at its first call; the machine code is cached beside the source."""
    return cast(F, Kernel(function))


def fast_jit(function: F) -> F:
    """As `jit`, for loops over many numbers: sums may be taken in another order, and so eight at a time."""
    return cast(F, Kernel(function, error_model="numpy", fastmath=set(_REORDER)))
