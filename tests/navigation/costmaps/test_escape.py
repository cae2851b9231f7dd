"""Which motions lead a robot away from what it touches by the costmap."""

from __future__ import annotations

import numpy as np
import pytest

from twin.navigation.costmaps.kernels import escapes, outline_cost
from twin.navigation.costmaps.layered_costmap import CostmapConfig, LayeredCostmap

HERE, FRAME = (0.0, 0.0, 0.0), (-1.0, -1.0, 0.025)
CORNERS = np.array([[0.2, 0.15], [-0.2, 0.15], [-0.2, -0.15], [0.2, -0.15]])


@pytest.mark.parametrize(
    ("v", "w", "expected"),
    [
        (-0.15, 0.0, True),
        (0.15, 0.0, False),  # its outline would leave the surface behind: further in all the same
        (0.0, -0.5, True),
        (0.0, 0.0, False),
    ],
)
def test_from_the_surface_of_a_thing_at_the_left_front_corner(v: float, w: float, expected: bool) -> None:
    costs = np.zeros((80, 80), dtype=np.uint8)
    costs[44:54, 47] = 254  # seen from the front: x 0.175 to 0.2, y 0.1 to 0.35
    costs[45, 44:47] = 254  # and from the side: y 0.125 to 0.15, x from 0.1 on
    assert escapes(costs, CORNERS, HERE, (v, w), 0.05, 20, FRAME) is expected


def test_a_robot_whose_outlines_cells_touch_something_may_back_off() -> None:
    """The cell of its corner is lethal, what is in it is beside the robot: no sample is inside of it."""
    costs = np.zeros((80, 80), dtype=np.uint8)
    x, y = CORNERS.max(axis=0)
    costs[int((y + 0.01 + 1.0) / 0.025), int((x + 0.01 + 1.0) / 0.025)] = 254
    assert escapes(costs, CORNERS, HERE, (-0.15, 0.0), 0.05, 20, FRAME)


@pytest.mark.parametrize(("v", "expected"), [(-0.15, True), (0.15, False)])
def test_an_outline_that_grazes_a_cell_which_no_sample_of_the_inside_hits(v: float, expected: bool) -> None:
    corners = np.array([[0.21, 0.15], [-0.2, 0.15], [-0.2, -0.15], [0.21, -0.15]])
    costs = np.zeros((40, 40), dtype=np.uint8)
    costs[:, 24] = 254  # from x = 0.205 m on
    frame = (-0.995, -1.0, 0.05)
    assert outline_cost(costs, corners, HERE, frame) == 254
    assert escapes(costs, corners, HERE, (v, 0.0), 0.05, 20, frame) is expected


def test_what_is_known_of_a_map_is_marked_without_a_ray_and_cleared_by_one() -> None:
    layers = LayeredCostmap(config=CostmapConfig(rolling_window=True, width=4.0, height=4.0))
    layers.mark(np.array([[-1.02, 0.02], [50.0, 0.0]]))
    assert layers.costmap.cost_at(-1.02, 0.02) == 254
    layers.update([[-1.5, 0.03]], (0.0, 0.0))
    assert layers.costmap.cost_at(-1.02, 0.02) < 254
