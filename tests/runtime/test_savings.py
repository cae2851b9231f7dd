"""What a run saves changes none of its messages: each saving off, one after the other, is the oracle."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import pytest

from twin.runtime.open_run import run
from twin.savings import ALL
from twin.scenario.schema import Scenario, load

SCENARIOS = Path(__file__).parents[2] / "scenarios"


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load(SCENARIOS / "warehouse.yaml", {"duration": "3 s"})


@pytest.fixture(scope="module")
def digest(scenario: Scenario) -> str:
    return run(scenario, record=False).digest


@pytest.mark.parametrize("saving", [field.name for field in fields(ALL)])
def test_the_digest_is_the_same_without_it(saving: str, scenario: Scenario, digest: str) -> None:
    assert run(scenario, record=False, savings=replace(ALL, **{saving: False})).digest == digest
