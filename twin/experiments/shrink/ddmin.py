"""Delta debugging: a smallest part of what makes something fail.

Zeller and Hildebrandt, "Simplifying and Isolating Failure-Inducing Input", IEEE Transactions on Software
Engineering 28(2), 2002: the algorithm ddmin.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TypeVar

T = TypeVar("T")


def ddmin(items: Sequence[T], first_failing: Callable[[Sequence[Sequence[T]]], int | None]) -> list[T]:
    """Return some of the items that still fail together, and of which each single one is needed for that.

    Args:
        items: Which fail together.
        first_failing: Returns the index of the first of several selections that fails; None: none does.
            A selection that cannot be tried does not fail.
    """
    left = list(items)
    if left and first_failing([[]]) is not None:
        return []
    parts = 2
    while len(left) > 1:
        subsets = _split(left, parts)
        found = first_failing(subsets)
        if found is not None:
            left, parts = subsets[found], 2
            continue
        if parts > 2:  # else they are the subsets
            complements = [
                [item for other in subsets if other is not each for item in other] for each in subsets
            ]
            found = first_failing(complements)
            if found is not None:
                left, parts = complements[found], max(parts - 1, 2)
                continue
        if parts >= len(left):
            break
        parts = min(2 * parts, len(left))
    return left


def _split(items: list[T], parts: int) -> list[list[T]]:
    """Cut a list into so many parts, as even as possible."""
    ends = [len(items) * part // parts for part in range(parts + 1)]
    return [items[begin:end] for begin, end in pairwise(ends)]
