"""The one way this package compiles a function: numba, cached on disk, typed as the Python function."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])


def jit(function: F) -> F:
    """Return `function` compiled at its first call; the machine code is cached beside the source."""
    return cast(F, numba.njit(cache=True)(function))
