"""Which motions lead a robot away from what it touches by the costmap."""

from __future__ import annotations

import numpy as np
import pytest

from twin.navigation.costmaps.kernels import escapes

CORNERS = np.array([[0.2, 0.15], [-0.2, 0.15], [-0.2, -0.15], [0.2, -0.15]])


@pytest.mark.parametrize(
    ("v", "w", "expected"),
    [(-0.15, 0.0, True), (0.15, 0.0, False), (0.0, 0.5, False), (0.0, -0.5, True), (0.0, 0.0, False)],
)
def test_from_a_thing_at_the_left_side(v: float, w: float, expected: bool) -> None:
    costs = np.zeros((80, 80), dtype=np.uint8)
    costs[45:47, 44:47] = 254  # on the left side, ahead: x 0.1 to 0.175, y 0.125 to 0.175
    frame = (-1.0, -1.0, 0.025)
    assert escapes(costs, CORNERS, 0.0, 0.0, 0.0, v, w, 0.05, 20, *frame) is expected
