"""Joints as measured, commands as taken."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.sim.conftest import placed
from twin.errors import SimulationError
from twin.sim.indices import indices
from twin.sim.noise import NoiseStream
from twin.sim.scene import Scene
from twin.sim.world import World

TICK = 2.0 * math.pi / 4096


@pytest.fixture
def world(room: Scene) -> World:
    return World.compose(room, [placed(sensors=())], seed=5)


def test_commands_take_effect_only_when_applied(world: World) -> None:
    hardware = world.robots["cart"].hardware
    hardware.command("left_wheel_joint", 3.0)
    world.step(50)
    assert hardware.read().velocity[0] == 0.0
    hardware.apply()
    world.step(50)
    assert hardware.read().velocity[0] > 1.0


def test_a_command_that_is_not_finite_is_refused_and_counted(world: World) -> None:
    hardware = world.robots["cart"].hardware
    hardware.command("left_wheel_joint", 3.0)
    hardware.command("left_wheel_joint", math.nan)
    hardware.command("right_wheel_joint", math.inf)
    hardware.apply()
    assert hardware.refused == 2
    np.testing.assert_array_equal(world.data.ctrl, [3.0, 0.0, 0.0])


def test_a_joint_without_actuator_is_named(world: World) -> None:
    with pytest.raises(
        SimulationError, match="no actuator for joint 'left_wheel'; did you mean 'left_wheel_joint'"
    ):
        world.robots["cart"].hardware.command("left_wheel", 1.0)


def test_encoders_count_whole_ticks_and_differentiate_them(world: World) -> None:
    hardware = world.robots["cart"].hardware
    hardware.command("left_wheel_joint", 3.0)
    hardware.command("right_wheel_joint", 3.0)
    hardware.apply()
    before = hardware.read()
    for _ in range(50):
        world.step(10)
        reading = hardware.read()
        true = world.data.joint("cart/left_wheel_joint").qpos[0]
        assert abs(reading.position[0] - true) <= TICK / 2 + 1e-12
        assert reading.position[0] / TICK == pytest.approx(round(reading.position[0] / TICK), abs=1e-6)
        assert reading.velocity[0] == pytest.approx(
            (reading.position[0] - before.position[0]) / 0.02, abs=1e-9
        )
        before = reading
    assert reading.velocity[0] == pytest.approx(3.0, abs=TICK / 0.02 + 0.05)


@pytest.mark.parametrize("factor", [-1.0, 0.0, 1.5])
def test_an_encoder_that_misreads_goes_on_from_where_it_was(world: World, factor: float) -> None:
    hardware = world.robots["cart"].hardware
    hardware.command("left_wheel_joint", 3.0)
    hardware.command("right_wheel_joint", 3.0)
    hardware.apply()
    world.step(500)
    before, true = hardware.read().position, world.data.joint("cart/left_wheel_joint").qpos[0]
    hardware.misread("left_wheel_joint", factor)
    world.step(1)
    assert hardware.read().position[0] == pytest.approx(before[0], abs=0.02), "it does not jump"
    world.step(500)
    after, turned = hardware.read().position, world.data.joint("cart/left_wheel_joint").qpos[0] - true
    assert after[0] - before[0] == pytest.approx(factor * turned, rel=0.01, abs=2.0 * TICK)
    assert after[1] - before[1] == pytest.approx(turned, rel=0.01), "the other wheel's counts rightly"
    with pytest.raises(SimulationError, match="no encoder measures joint 'mast_joint'"):
        hardware.misread("mast_joint", factor)


def test_an_encoder_can_be_mended(world: World) -> None:
    hardware = world.robots["cart"].hardware
    hardware.command("left_wheel_joint", 3.0)
    hardware.apply()
    for factor in (-1.0, 0.0, 1.0):
        hardware.misread("left_wheel_joint", factor)
    before, true = hardware.read().position[0], world.data.joint("cart/left_wheel_joint").qpos[0]
    world.step(500)
    turned = world.data.joint("cart/left_wheel_joint").qpos[0] - true
    assert hardware.read().position[0] - before == pytest.approx(turned, rel=0.01)


def test_other_joints_have_a_little_noise_and_reach_their_command(world: World) -> None:
    hardware = world.robots["cart"].hardware
    hardware.command("mast_joint", 0.2)
    hardware.apply()
    world.step(1000)
    positions = []
    for _ in range(100):
        world.step(10)
        positions.append(hardware.read().position[2])
    assert np.mean(positions) == pytest.approx(0.2, abs=0.003)
    assert 5e-5 < np.std(positions) < 2e-4


def test_reading_twice_at_one_time_is_the_same_reading(world: World) -> None:
    world.step(10)
    hardware = world.robots["cart"].hardware
    assert hardware.read() is hardware.read()


def test_effort_is_what_the_actuator_gives(world: World) -> None:
    hardware = world.robots["cart"].hardware
    hardware.command("mast_joint", 0.1)
    hardware.apply()
    world.step(2000)
    # The mast of 0.3 kg is held up by the position servo.
    assert hardware.read().effort[2] == pytest.approx(0.3 * 9.81, rel=0.01)


def test_a_reading_is_what_sensors_measure_of_all_joints_at_once(world: World) -> None:
    """To the last bit: counts of wheels, noise on the mast."""
    hardware, data = world.robots["cart"].hardware, world.data
    assert hardware.joint_names == ("left_wheel_joint", "right_wheel_joint", "mast_joint")
    joints = [world.model.joint(f"cart/{name}") for name in hardware.joint_names]
    qpos, dof = (np.array([getattr(joint, name)[0] for joint in joints]) for name in ("qposadr", "dofadr"))
    noise, encoder = NoiseStream(5, "cart/joints"), np.array([True, True, False])
    scale, lost = np.ones(3), np.zeros(3)
    before = np.rint(data.qpos[qpos] * scale / TICK)
    for tick in range(20):
        hardware.command("left_wheel_joint", 3.0 - 0.3 * tick)
        hardware.command("mast_joint", 0.01 * tick)
        hardware.apply()
        world.step(3 + tick % 2)
        if tick == 8:
            hardware.miscount("right_wheel_joint", 1.0)
            lost[1] += round(1.0 / TICK)
        if tick == 12:
            hardware.misread("left_wheel_joint", -1.0)
            lost += np.rint(data.qpos[qpos] * scale / TICK)
            scale[0] = -1.0
            lost -= np.rint(data.qpos[qpos] * scale / TICK)
        counts = np.rint(data.qpos[qpos] * scale / TICK) + lost
        drawn = noise.normal(world.step_count, 6)
        position = np.where(encoder, counts * TICK, data.qpos[qpos] + 1e-4 * drawn[:3])
        elapsed = (3 + tick % 2) * 0.002
        speed = (counts - before) * (TICK / elapsed)
        velocity = np.where(encoder, speed, data.qvel[dof] + 1e-3 * drawn[3:])
        reading = hardware.read()
        np.testing.assert_array_equal(reading.position, position)
        np.testing.assert_array_equal(reading.velocity, velocity)
        np.testing.assert_array_equal(reading.effort, data.qfrc_actuator[dof])
        before = counts


def test_indices_that_follow_each_other_are_a_slice() -> None:
    values = np.arange(10.0)
    for some in ([], [4], [2, 3, 4], [2, 4], [4, 3], [3, 3]):
        np.testing.assert_array_equal(values[indices(some)], values[np.array(some, dtype=np.intp)])
    assert indices([2, 3, 4]) == slice(2, 5)
