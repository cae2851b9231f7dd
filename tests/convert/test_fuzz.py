"""A short fuzz run; `python -m tests.oracles.fuzz --count 5000` is a long one."""

from __future__ import annotations

import pytest

from tests.oracles.fuzz import broken, run


@pytest.mark.timeout(60)
@pytest.mark.parametrize("first", [0, 50, 100])
def test_broken_robots_end_in_errors(first: int) -> None:
    outcomes = run(range(first, first + 50))
    assert outcomes["accepted"] >= 5  # it gets through to the export


@pytest.mark.parametrize("seed", [1933, 2495])
def test_what_was_found(seed: int) -> None:
    assert sum(run(range(seed, seed + 1)).values()) == 1


def test_a_seed_is_always_the_same_text() -> None:
    assert [broken(seed) for seed in range(20)] == [broken(seed) for seed in range(20)]
