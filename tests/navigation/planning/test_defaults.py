"""Planners and smoothers are by default what they are in Nav2, but for a few."""

from __future__ import annotations

from typing import Any

import pytest

from tests.documented import other_ranges
from tests.oracles.nav2_defaults import compared
from twin.navigation.planning import config as ours_of


@pytest.mark.parametrize(
    ("component", "config", "shared", "ours"),
    [
        ("navfn", ours_of.PlannerConfig(), 2, {}),
        ("theta star", ours_of.ThetaStarConfig(), 3, {}),
        ("smac hybrid", ours_of.HybridConfig(), 12, {}),
        ("simple smoother", ours_of.SmootherConfig(), 5, {"tolerance": 1e-6}),
        ("savitzky-golay smoother", ours_of.SavitzkyGolayConfig(), 2, {}),
    ],
)
def test_defaults_are_nav2s(component: str, config: Any, shared: int, ours: dict[str, Any]) -> None:
    assert compared(component, config) == (shared, ours)


@pytest.mark.parametrize(
    ("section", "config", "shared"),
    [
        ("planner", ours_of.PlannerConfig(), 4),
        ("planner", ours_of.ThetaStarConfig(), 5),
        ("planner", ours_of.HybridConfig(), 13),
        ("planner", ours_of.CommitmentConfig(), 2),
        ("planner", ours_of.GoalAccessConfig(), 3),
        ("smoother", ours_of.SmootherConfig(), 5),
        ("smoother", ours_of.SavitzkyGolayConfig(), 2),
    ],
)
def test_ranges_are_those_that_the_docs_tell(section: str, config: Any, shared: int) -> None:
    assert other_ranges(f"robots[].navigation.{section}", config) == (shared, {})
