"""Whether kernels are there before they are needed."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import ParamSpec

P = ParamSpec("P")

_ahead = ContextVar("ahead", default=True)


@contextmanager
def kernels_ahead(needed: bool) -> Iterator[None]:
    """Say whether nodes that are made in the block load, or compile, at once what they may come to run.

    Who keeps time with a clock on the wall needs that; a run as fast as possible loads what it uses when it
    does.
    """
    before = _ahead.set(needed)
    try:
        yield
    finally:
        _ahead.reset(before)


def ahead(warm_up: Callable[P, None]) -> Callable[P, None]:
    """Decorate a function that runs kernels only so that they are there."""

    @functools.wraps(warm_up)
    def if_needed(*args: P.args, **kwargs: P.kwargs) -> None:
        if _ahead.get():
            warm_up(*args, **kwargs)

    return if_needed
