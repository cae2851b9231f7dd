"""The checks of the capstone bite."""

from __future__ import annotations

import os

import pytest

from twin.experiments.mutants import mutate
from twin.experiments.trials import Trials
from twin.scenario.schema import load


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_the_warehouse_catches_nine_of_ten_known_bad_stacks() -> None:
    with Trials(count=os.cpu_count() or 1) as trials:
        report = mutate(load("warehouse").source, trials)
    assert len(report.of("caught")) >= 38
    assert report.score is not None
    assert report.score >= 0.9, f"survived: {report.of('survived')}"
