"""The work of actuators, held against an integral of its own and against the weight that they lift."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tests.sim.conftest import placed
from twin.sim.scene import Scene
from twin.sim.work import WorkMeter
from twin.sim.world import World

MAST = 0.3 * 9.81
"""Weight of the lifting mast [N]."""


@pytest.fixture
def world() -> World:
    world = World.compose(Scene(name="empty"), [placed(base="fixed", sensors=())], seed=2)
    world.step(200)
    world.measure_work()
    return world


def run(world: World, seconds: float, command: Callable[[float], float]) -> None:
    """Command the mast every 20 ms; `command` maps the time [s] to a height [m]."""
    hardware = world.robots["cart"].hardware
    for tick in range(round(seconds / 0.02)):
        hardware.command("mast_joint", command((tick + 1) * 0.02))
        hardware.apply()
        world.step(10)


def test_lifting_costs_what_the_weight_takes_and_lowering_gives_nothing_back(world: World) -> None:
    run(world, 8.0, lambda t: min(0.02 * t, 0.15))
    lifted = world.work("cart")
    # 20 Ns/m of damping are overcome over 0.15 m, too
    assert lifted == pytest.approx((MAST + 20.0 * 0.02) * 0.15, rel=0.1)
    run(world, 8.0, lambda t: max(0.15 - 0.02 * t, 0.0))
    assert world.work("cart") == pytest.approx(lifted, rel=0.05)


def test_it_is_force_times_true_velocity_in_every_physics_step(world: World) -> None:
    """A mast that follows coarse steps is hurled and caught within each tick; its end does not show it."""
    joint, data = world.model.joint("cart/mast_joint").dofadr[0], world.data
    fine = coarse = 0.0
    hardware = world.robots["cart"].hardware
    for tick in range(50):
        hardware.command("mast_joint", 0.003 * (tick + 1))
        hardware.apply()
        for _ in range(10):
            before = data.qvel[joint]
            world.step(1)
            fine += max(0.0, data.qfrc_actuator[joint] * (before + data.qvel[joint]) / 2.0) * 0.002
        coarse += max(0.0, data.qfrc_actuator[joint] * data.qvel[joint]) * 0.02
    assert world.work("cart") == pytest.approx(fine, rel=1e-6)
    assert abs(coarse - fine) > 0.2 * fine


def test_measuring_changes_nothing(world: World) -> None:
    other = World.compose(Scene(name="empty"), [placed(base="fixed", sensors=())], seed=2)
    other.step(200)
    for each in (world, other):
        run(each, 0.4, lambda t: 0.1)
    assert world.state_digest() == other.state_digest()
    assert np.isclose(other.work("cart"), 0.0)


def test_adding_up_later_is_adding_up_at_once(world: World) -> None:
    """To the last bit, however many steps are between."""
    data, rng = world.data, np.random.default_rng(1)
    meter, joints = WorkMeter(world.model, data, ("cart",)), world.model.actuator_trnid[:, 0]
    dofs, half_step, work = world.model.jnt_dofadr[joints], 0.5 * world.model.opt.timestep, np.zeros(3)
    for i, steps in enumerate([10] * 40 + [3, 1, 200, 10, 7, 13] * 5):
        meter.begin(steps)
        forces, velocities = [], [data.qvel.copy()]
        for _ in range(steps):
            data.qfrc_actuator[:], data.qvel[:] = rng.normal(size=(2, world.model.nv))
            meter.note()
            forces.append(data.qfrc_actuator.copy())
            velocities.append(data.qvel.copy())
        speeds = np.array(velocities)[:, dofs]
        powers = np.array(forces)[:, dofs] * (speeds[:-1] + speeds[1:])
        work += half_step * sum(np.maximum(powers, 0.0))  # step by step
        if i % 5 == 0:
            assert meter.work("cart") == work.sum()
    assert meter.work("cart") == work.sum() > 0.0
