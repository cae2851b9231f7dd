"""Docking is by default what it is in Nav2, but for a few."""

from __future__ import annotations

from tests.documented import other_ranges
from tests.oracles.nav2_defaults import compared
from twin.navigation.docking.config import DockCollisionConfig, DockEstimateConfig, LineApproachConfig


def test_defaults_are_nav2s() -> None:
    ours = {"v_angular_max": 0.5, "v_linear_min": 0.02}  # calm: docks here are a few millimetres wide
    assert compared("docking controller", LineApproachConfig()) == (3, ours)
    assert compared("docking controller", DockCollisionConfig()) == (4, {})


def test_ranges_are_those_that_the_docs_tell() -> None:
    section = "robots[].navigation.docking"
    assert other_ranges(f"{section}.dock", LineApproachConfig()) == (13, {})
    assert other_ranges(f"{section}.estimate", DockEstimateConfig()) == (9, {})
