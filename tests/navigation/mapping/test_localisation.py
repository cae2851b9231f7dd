"""Where a robot is looked for in a map: as far as odometry may be off, but never nowhere."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

from twin.geometry import Pose2
from twin.navigation.mapping.config import SlamConfig
from twin.navigation.mapping.registration import START_COVARIANCE, START_WINDOW, at_start, while_driving

GUESS = Pose2(1.0, 2.0, 0.5)


class Nowhere:
    """A map that fits nothing; notes what was asked."""

    def __init__(self, config: SlamConfig) -> None:
        self.config = config
        self.half_width = np.nan
        self.asked: tuple[Any, ...] = ()

    def near(self, guess: Pose2) -> list[int]:
        assert guess == GUESS
        return [0]

    def registration(self, nodes: list[int], half_width: float) -> Nowhere:
        assert nodes == [0]
        self.half_width = half_width
        return self

    def match(self, *asked: Any) -> None:
        self.asked = asked


@pytest.mark.parametrize(
    ("deviation", "half_width"),
    [(0.1, 1.5), (0.6, 1.8), (2.0, 4.0)],
    ids=["the least window", "three standard deviations", "the widest window"],
)
def test_how_far_a_robot_that_drives_is_looked_for(deviation: float, half_width: float) -> None:
    mapped = Nowhere(SlamConfig(correlation_search_space_dimension=3.0, loop_search_space_dimension=8.0))
    prior = np.diag([0.01, deviation**2, 9.0]) if deviation > 0.1 else np.diag([0.01, 0.01, 9.0])
    found = while_driving(cast("Any", mapped), cast("Any", None), GUESS, prior)
    assert mapped.half_width == pytest.approx(half_width)
    assert mapped.asked[1] == GUESS
    assert mapped.asked[2] is prior
    assert found == (GUESS, prior, None), "odometry alone is believed"


def test_who_is_said_to_be_somewhere_is_looked_for_within_two_metres_and_a_radian() -> None:
    mapped = Nowhere(SlamConfig())
    found = at_start(cast("Any", mapped), cast("Any", None), GUESS)
    assert mapped.half_width == START_WINDOW[0] == 2.0
    assert mapped.asked[1:] == (GUESS, START_COVARIANCE, 1.0)
    assert found == (GUESS, START_COVARIANCE, None)
    assert np.diag(START_COVARIANCE).tolist() == [1.0, 1.0, 0.3]
