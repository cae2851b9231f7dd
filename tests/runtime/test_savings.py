"""What a run saves changes none of its messages: each saving off, one after the other, is the oracle."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from twin.bridge.topics import Publisher
from twin.runtime.open_run import OpenRun, run
from twin.savings import ALL
from twin.scenario.schema import Scenario, load

SCENARIOS = Path(__file__).parents[2] / "scenarios"


class Said(NamedTuple):
    publisher: Publisher[Any]
    message: Any
    payload: bytes


class Whole(NamedTuple):
    """A run with every saving."""

    digest: str
    messages: list[Said]


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load(SCENARIOS / "warehouse.yaml", {"duration": "3 s"})


@pytest.fixture(scope="module")
def whole(scenario: Scenario) -> Whole:
    opened = OpenRun(scenario, record=False)
    messages: list[Said] = []
    opened.run.bus.tap(lambda sample: messages.append(Said(sample.publisher, sample.message, sample.payload)))
    opened.advance()
    return Whole(opened.finish().digest, messages)


@pytest.mark.parametrize("saving", [field.name for field in fields(ALL)])
def test_the_digest_is_the_same_without_it(saving: str, scenario: Scenario, whole: Whole) -> None:
    assert run(scenario, record=False, savings=replace(ALL, **{saving: False})).digest == whole.digest


def test_no_message_is_changed_once_it_was_published(whole: Whole) -> None:
    """Neither by who published it nor by who heard it: others in the process were given the same object."""
    assert len(whole.messages) > 1000
    changed = [s.publisher.name for s in whole.messages if s.publisher.codec.encode(s.message) != s.payload]
    assert not changed
