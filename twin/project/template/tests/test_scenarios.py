"""Every scenario of this project passes."""

from pathlib import Path

import pytest
import twin

SCENARIOS = sorted((Path(__file__).parents[1] / "scenarios").glob("*.yaml"))


@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda file: file.stem)
def test_scenario_passes(scenario: Path) -> None:
    verdict = twin.run(scenario)
    assert [f"{check.name}: {check.reason}" for check in verdict.checks if not check.passed] == []


def test_the_robot_can_be_driven() -> None:
    """A scenario is a test of the whole; a simulation can also be looked into while it runs."""
    overrides = {"mission": {"type": "idle"}}
