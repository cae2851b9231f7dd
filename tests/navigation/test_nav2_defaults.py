"""A parameter that nobody sets is what it is in Nav2 (tests/oracles/nav2_defaults.py), but for a few.

The others are beside the tests of what they configure: test_defaults.py.
"""

from __future__ import annotations

from tests.oracles.nav2_defaults import compared
from twin.navigation.recovery import BehaviorConfig


def test_behaviours() -> None:
    ours = {"deceleration_limit": 2.5, "minimum_speed": 0.05}  # a magnitude; what the robots here can drive
    assert compared("behaviors", BehaviorConfig()) == (9, ours)
