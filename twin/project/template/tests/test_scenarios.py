"""Every scenario of this project passes."""

from pathlib import Path

import pytest

import twin

SCENARIOS = sorted((Path(__file__).parents[1] / "scenarios").glob("*.yaml"))


@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda file: file.stem)
def test_scenario_passes(scenario: Path) -> None:
    """Run it, and name the checks that do not hold."""
    verdict = twin.run(scenario)
    assert [f"{check.name}: {check.reason}" for check in verdict.checks if not check.passed] == []
