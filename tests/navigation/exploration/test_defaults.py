"""Parameters of exploration are as the docs tell."""

from __future__ import annotations

from tests.documented import other_ranges
from twin.navigation.exploration.config import ExplorerConfig, FrontierConfig


def test_ranges_are_those_that_the_docs_tell() -> None:
    assert other_ranges("mission (type: explore)", ExplorerConfig()) == (6, {})
    assert other_ranges("mission (type: explore)", FrontierConfig()) == (4, {})


def test_defaults_are_explore_lites() -> None:
    """Of its explore.cpp, but for potential_scale, which is that of its explore.yaml."""
    config = ExplorerConfig()
    assert (config.potential_scale, config.gain_scale, config.orientation_scale) == (3.0, 1.0, 0.0)
    assert config.progress_timeout == 30.0
    assert config.frontiers.min_frontier_size == 0.5
