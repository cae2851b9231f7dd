"""Delta debugging: what is left fails, and nothing of it can go."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from twin.experiments.shrink.ddmin import ddmin

Fails = Callable[[Sequence[int]], bool]


def first(
    fails: Fails, tried: list[tuple[int, ...]] | None = None
) -> Callable[[Sequence[Sequence[int]]], int | None]:
    def first_failing(selections: Sequence[Sequence[int]]) -> int | None:
        for index, some in enumerate(selections):
            if tried is not None:
                tried.append(tuple(some))
            if fails(some):
                return index
        return None

    return first_failing


@given(st.integers(1, 24), st.sets(st.integers(0, 23), max_size=5))
def test_what_is_needed_together_is_what_is_left(count: int, needed: set[int]) -> None:
    needed = {each for each in needed if each < count}
    assert set(ddmin(range(count), first(needed.issubset))) == needed


@given(
    st.integers(2, 12),
    st.lists(st.frozensets(st.integers(0, 11), min_size=1, max_size=4), min_size=1, max_size=4),
)
def test_of_several_causes_one_is_left_of_which_nothing_can_go(
    count: int, causes: list[frozenset[int]]
) -> None:
    def fails(some: Sequence[int]) -> bool:
        return any(cause <= set(some) for cause in causes) or len(some) == count

    left = ddmin(range(count), first(fails))
    assert fails(left)
    assert not any(fails([other for other in left if other != each]) for each in left)


def test_one_of_many_takes_few_tries() -> None:
    tried: list[tuple[int, ...]] = []
    assert ddmin(range(64), first(lambda some: 37 in some, tried)) == [37]
    assert len(tried) <= 1 + 2 * 6


def test_the_order_of_items_is_kept() -> None:
    assert ddmin(
        "abcdefgh",
        lambda selections: next((i for i, s in enumerate(selections) if {"b", "g"} <= set(s)), None),
    ) == ["b", "g"]


@pytest.mark.parametrize("items", [[], [1], [1, 2, 3]])
def test_what_fails_without_anything_needs_nothing(items: list[int]) -> None:
    assert ddmin(items, lambda selections: 0) == []
