"""What a run saves changes none of its messages: each saving off, one after the other, is the oracle."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from tests.savings import OFF
from twin.bridge.bags.reader import BagReader
from twin.bridge.topics import Publisher
from twin.runtime.open_run import OpenRun, run
from twin.savings import ALL
from twin.scenario.schema import Scenario, load
from twin.scenario.verdict import Verdict

SCENARIOS = Path(__file__).parents[2] / "scenarios"


class Said(NamedTuple):
    publisher: Publisher[Any]
    message: Any
    payload: bytes


class Whole(NamedTuple):
    """A run with every saving."""

    verdict: Verdict
    messages: list[Said]
    bag: Path


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load(SCENARIOS / "warehouse.yaml", {"duration": "3 s"})


@pytest.fixture(scope="module")
def whole(scenario: Scenario, tmp_path_factory: pytest.TempPathFactory) -> Whole:
    bag = tmp_path_factory.mktemp("whole") / "bag"
    opened = OpenRun(scenario, record=False, bag=bag)
    messages: list[Said] = []
    opened.run.bus.tap(lambda sample: messages.append(Said(sample.publisher, sample.message, sample.payload)))
    opened.advance()
    return Whole(opened.finish(), messages, bag)


@pytest.mark.parametrize("saving", [field.name for field in fields(ALL)])
def test_the_verdict_is_the_same_without_it(saving: str, scenario: Scenario, whole: Whole) -> None:
    verdict = run(scenario, record=False, savings=replace(ALL, **{saving: False}))
    assert (verdict.digest, verdict.checks) == (whole.verdict.digest, whole.verdict.checks)


def test_verdict_and_bag_are_the_same_without_any(scenario: Scenario, whole: Whole, tmp_path: Path) -> None:
    verdict = run(scenario, record=False, bag=tmp_path / "bag", savings=OFF)
    assert (verdict.digest, verdict.checks) == (whole.verdict.digest, whole.verdict.checks)
    with BagReader(tmp_path / "bag") as off, BagReader(whole.bag) as on:
        messages = list(on.messages())
        assert list(off.messages()) == messages
    assert len(messages) > 1000


def test_no_message_is_changed_once_it_was_published(whole: Whole) -> None:
    """Neither by who published it nor by who heard it: others in the process were given the same object."""
    assert len(whole.messages) > 1000
    changed = [s.publisher.name for s in whole.messages if s.publisher.codec.encode(s.message) != s.payload]
    assert not changed
