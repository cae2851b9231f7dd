"""Where the rays of a scan end."""

from __future__ import annotations

import numpy as np
import pytest

from twin.bridge.msgs import LaserScan, header
from twin.nodes.navigation.scan_input import scan_points


@pytest.mark.parametrize("inf_is_valid", [True, False])
@pytest.mark.parametrize("count", [1, 7, 360])
def test_a_ray_ends_at_its_range_in_its_direction(count: int, inf_is_valid: bool) -> None:
    """To the last bit, angle by angle; two lidars do not mix."""
    rng = np.random.default_rng(count)
    for start in (-3.1, 0.2):
        ranges = rng.uniform(0.0, 12.0, count).astype(np.float32)
        ranges[rng.random(count) < 0.2] = np.inf
        scan = LaserScan(
            header=header(0, "lidar"), angle_min=start, angle_max=3.1, angle_increment=0.0173,
            time_increment=0.0, scan_time=0.1, range_min=0.5, range_max=10.0, ranges=ranges,
            intensities=np.zeros(0, np.float32),
        )  # fmt: skip
        expected = []
        for i, distance in enumerate(ranges.tolist()):
            distance = (25.0 if inf_is_valid else np.nan) if distance > 10.0 else distance
            distance = np.nan if distance < 0.5 else distance
            angle = np.array([start + 0.0173 * i])
            expected.append([(distance * np.cos(angle))[0], (distance * np.sin(angle))[0]])
        np.testing.assert_array_equal(scan_points(scan, 25.0, inf_is_valid=inf_is_valid), expected)
