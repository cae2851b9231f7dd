"""`twin.World`: physics and sensors without nodes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import twin

ROBOT = twin.load_robot("diff_bot")


def test_a_robot_drives_as_told_and_stops() -> None:
    world = twin.World(ROBOT)
    robot = world.robots["diff_bot"]
    robot.drive(0.3, 0.0)
    world.advance(3.0)
    assert world.time == pytest.approx(3.0)
    speed_up = 0.3 / (2.0 * 0.3)  # at most; the drive's own limit is in its file
    assert 0.3 * (3.0 - speed_up) - 0.1 < world.pose("diff_bot").xyz[0] < 0.9
    robot.drive(0.0, 0.0)
    world.advance(2.0)
    at = world.pose("diff_bot").xyz
    world.advance(1.0)
    np.testing.assert_allclose(world.pose("diff_bot").xyz, at, atol=1e-4)


def test_joints_are_commanded_and_measured() -> None:
    world = twin.World({"a": ROBOT.at((0, 0, 0)), "b": ROBOT.at(twin.Pose2(3.0, 0.0, 1.0))})
    a, b = world.robots["a"], world.robots["b"]
    a.command(dict.fromkeys(a.commanded_joints, 2.0))
    world.step(100)
    reading = a.joints()
    turning = [a.joint_names.index(joint) for joint in a.commanded_joints]
    np.testing.assert_allclose(reading.velocity[turning], 2.0, atol=0.1)
    assert np.all(np.abs(b.joints().velocity) < 0.1)
    assert b.pose().to_pose2() == pytest.approx((3.0, 0.0, 1.0), abs=1e-3)
    assert {"a/base_link", "b/base_link"} <= set(world.bodies)


def test_sensors_see_the_arena() -> None:
    arena = twin.load_arena("warehouse")
    world = twin.World(ROBOT.at(arena.poses[next(iter(arena.poses))]), arena=arena)
    reading = world.robots["diff_bot"].read("lidar")
    ranges = reading.ranges[np.isfinite(reading.ranges)]
    assert len(ranges) > 100
    hall = arena.hall
    assert ranges.max() < np.hypot(hall.size_x, hall.size_y)


def test_the_seed_decides_and_nothing_else() -> None:
    def scan(seed: int) -> np.ndarray:
        world = twin.World(ROBOT, arena="warehouse", seed=seed)
        world.step(5)
        return world.robots["diff_bot"].read("lidar").ranges

    np.testing.assert_array_equal(scan(1), scan(1))
    assert np.any(scan(1) != scan(2))


def test_mistakes_are_one_sentence() -> None:
    world = twin.World(ROBOT)
    robot = world.robots["diff_bot"]
    with pytest.raises(twin.TwinError, match="has no sensor 'lidr'; did you mean 'lidar'"):
        robot.read("lidr")
    with pytest.raises(twin.TwinError, match="no actuator for joint 'left'"):
        robot.command({"left": 1.0})
    with pytest.raises(twin.TwinError, match="the command nan for joint 'x' is not finite"):
        robot.command({"x": float("nan")})
    with pytest.raises(twin.TwinError, match="is not finite"):
        robot.drive(float("inf"), 0.0)
    with pytest.raises(twin.TwinError, match="no body 'nobody'"):
        world.pose("nobody")
    with pytest.raises(twin.TwinError, match="no whole number of steps"):
        twin.World(ROBOT, control_period=0.003)
    with pytest.raises(twin.TwinError, match="no drive plugin"):
        twin.World(twin.load_robot("r2d2")).robots["r2d2"].drive(1.0, 0.0)


def test_a_sensor_of_ones_own() -> None:
    folder = Path(__file__).parents[2] / "examples" / "python"
    rover = twin.load_robot(folder / "rover.urdf", sensors=[f"{folder / 'own_sensor.py'}:Thermometer"])
    assert "thermometer" not in twin.World(twin.load_robot(folder / "rover.urdf")).robots["rover"].sensors
    world = twin.World(rover.at((2.0, 0.0, 0.0)))
    world.step()
    assert world.robots["rover"].read("thermometer") == pytest.approx(22.0, abs=0.3)
