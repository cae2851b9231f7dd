"""Expressions choose tests as pytest's do, and shards share them out."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.errors import ScenarioError
from twin.experiments.suite.cases import Case
from twin.experiments.suite.selection import selected, shard_of

CASES = [
    Case(file=Path("a.yaml"), name="arm[seed=1,speed=0.2]", tags=("quick",)),
    Case(file=Path("a.yaml"), name="arm[seed=2,speed=0.2]", tags=("quick", "nightly")),
    Case(file=Path("b.yaml"), name="Base[seed=1]", tags=()),
]


@pytest.mark.parametrize(
    ("keyword", "tags", "numbers"),
    [
        ("", "", [0, 1, 2]),
        ("arm", "", [0, 1]),
        ("base", "", [2]),
        ("seed=1", "", [0, 2]),
        ("seed=1 and not arm", "", [2]),
        ("not arm or seed=2", "", [1, 2]),
        ("not (arm or seed=2)", "", [2]),
        ("not not arm", "", [0, 1]),
        ("arm and seed=2 or base", "", [1, 2]),
        ("", "quick", [0, 1]),
        ("", "quick and not nightly", [0]),
        ("", "not quick", [2]),
        ("seed=2", "quick", [1]),
    ],
)
def test_expressions(keyword: str, tags: str, numbers: list[int]) -> None:
    assert selected(CASES, keyword=keyword, tags=tags) == [CASES[i] for i in numbers]


def test_a_tag_is_meant_whole() -> None:
    with pytest.raises(ScenarioError, match="-m qui: chooses none of 3 tests; tags: nightly, quick"):
        selected(CASES, tags="qui")


@pytest.mark.parametrize("text", ["and", "a and", "(a", "a b", "not", "a )", "()", "or a"])
def test_what_is_no_expression(text: str) -> None:
    with pytest.raises(ScenarioError, match="must be words with and, or, not and brackets"):
        selected(CASES, keyword=text)


@pytest.mark.parametrize("parts", [1, 2, 3, 5])
def test_shards_have_every_test_once(parts: int) -> None:
    found = [selected(CASES, shard=(part, parts)) for part in range(1, parts + 1)]
    assert sorted(case.name for part in found for case in part) == sorted(case.name for case in CASES)
    assert max(map(len, found)) - min(map(len, found)) <= 1


@pytest.mark.parametrize("text", ["0/2", "3/2", "1", "a/b", "1/0", "-1/2", "1/2/3"])
def test_what_is_no_shard(text: str) -> None:
    with pytest.raises(ScenarioError, match=f"--shard {text}: must be I/N"):
        shard_of(text)
    assert shard_of("2/3") == (2, 3)
