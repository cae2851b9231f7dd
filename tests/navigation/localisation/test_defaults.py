"""Localisation is by default what it is in Nav2 and robot_localization, but for a few."""

from __future__ import annotations

from tests.documented import other_ranges
from tests.oracles.nav2_defaults import compared
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.navigation.localisation.ekf import EkfConfig


def test_amcls_defaults_are_nav2s() -> None:
    shared, ours = compared("amcl", AmclConfig())
    assert shared == 29
    assert ours == {
        # Of the robots here, whose odometry is better than Nav2 takes it to be.
        "alpha1": 0.01,
        "alpha2": 0.01,
        "alpha3": 0.01,
        "alpha4": 0.01,
        "alpha5": 0.01,
        "sigma_hit": 0.1,
        "recovery_alpha_fast": 0.1,
        "recovery_alpha_slow": 0.001,  # one carried away is to find itself
    }


def test_the_filters_defaults_are_robot_localizations() -> None:
    """Of `filter_base.cpp`, diagonals."""
    noise = (0.05, 0.05, 0.06, 0.03, 0.03, 0.06, 0.025, 0.025, 0.04, 0.01, 0.01, 0.02, 0.01, 0.01, 0.015)
    assert EkfConfig().process_noise_covariance == noise
    assert EkfConfig().initial_estimate_covariance == (1e-9,) * 15
    assert not EkfConfig().two_d_mode


def test_ranges_are_those_that_the_docs_tell() -> None:
    assert other_ranges("robots[].localisation (type: amcl).parameters", AmclConfig()) == (34, {})
