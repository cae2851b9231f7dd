from __future__ import annotations

import math
import re

import pytest

from .conftest import Start


def test_the_point_ahead_of_a_turning_laser_is_found_in_the_map(start: Start) -> None:
    listener = start("tf_listener", "--period", "0.05")
    start("static_tf_broadcaster")
    start("tf_rotating_laser", "--period", "0.02")
    listener.wait_for("is in map")
    found = re.findall(r"laser at (-?\d+)° is in map \((.*?), (.*?), (.*?)\)", listener.text)
    angle, x, y, z = map(float, found[-1])
    assert z == pytest.approx(0.1)
    forward = math.radians(45.0)
    laser = 2.0 + 0.2 * math.cos(forward), 1.0 + 0.2 * math.sin(forward)
    assert math.dist((x, y), laser) == pytest.approx(1.0, abs=2e-3)
    seen = math.degrees(math.atan2(y - laser[1], x - laser[0]))
    assert (seen - 45.0 - angle + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=1.0)


def test_the_corners_of_the_robot_are_found_in_the_map(start: Start) -> None:
    start("static_tf_broadcaster")
    corners = start("robot_corners")
    assert corners.finish() == 0
    found = re.findall(r"corner at \((.*?), (.*?)\)", corners.text)
    c = math.sqrt(0.5)
    expected = [
        (2.0 + c * (x - y), 1.0 + c * (x + y))
        for x, y in ((0.3, 0.45), (0.3, -0.45), (-0.3, -0.45), (-0.3, 0.45))
    ]
    assert [tuple(map(float, corner)) for corner in found] == [pytest.approx(e, abs=1e-3) for e in expected]
