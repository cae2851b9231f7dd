"""Distances to what is not free: SciPy's, up to where they are cut off."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from twin.navigation.maps.clearance import clearance


@pytest.mark.parametrize("most", [1, 3, 12, 100])
@pytest.mark.parametrize("shape", [(40, 60), (60, 40), (1, 30), (30, 1)])
def test_they_are_those_of_scipy_up_to_the_limit(shape: tuple[int, int], most: int) -> None:
    free = np.random.default_rng(most).random(shape) > 0.02
    free[0, 0] = False
    expected = np.minimum(ndimage.distance_transform_edt(free), most)
    assert np.array_equal(clearance(free, most), expected)


def test_where_all_is_free_everything_is_as_far_as_can_be() -> None:
    assert (clearance(np.ones((3, 4), dtype=bool), 5) == 5.0).all()
