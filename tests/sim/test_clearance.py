"""How near a robot is to everything else."""

from __future__ import annotations

import mujoco
import numpy as np

from twin.api.simulation import Simulation
from twin.geometry import quat_wxyz_from_yaw
from twin.sim.clearance import FARTHEST, ClearanceMeter


def test_it_is_the_least_distance_of_all_pairs_wherever_robot_and_goods_are() -> None:
    with Simulation("warehouse", record=False) as simulation:
        world = simulation._running.run.world
        (robot,) = world.robots
        model, data = world.model, world.data
        names = [model.body(body).name for body in model.geom_bodyid]
        solid = [i for i in range(model.ngeom) if model.geom_contype[i] and model.geom(i).name != "floor"]
        own = [i for i in solid if names[i].startswith(f"{robot}/")]
        others = [i for i in solid if not names[i].startswith(f"{robot}/")]
        meter, found = ClearanceMeter(world), []

        def put(body: str, x: float, y: float, yaw: float) -> None:
            start = model.jnt_qposadr[model.body_jntadr[model.body(body).id]]
            data.qpos[start : start + 2] = x, y
            data.qpos[start + 3 : start + 7] = quat_wxyz_from_yaw(yaw)

        for x, y, yaw in np.random.default_rng(0).uniform((-6, -4, -3), (6, 4, 3), (6, 3)).tolist():
            # A small turn: what is nearest changes, and how far it is but little.
            for turned, tote_y in ((yaw, y), (yaw + 0.4, y), (yaw + 0.4, y + 3.0)):
                put(world.robots[robot].base, x, y, turned)
                put("tote_a", x + 1.0, tote_y, turned)
                mujoco.mj_kinematics(model, data)
                pairs = [(i, j) for i in own for j in others]
                least = min(mujoco.mj_geomDistance(model, data, i, j, FARTHEST, None) for i, j in pairs)
                found.append((meter.clearance(robot), least))
    clearances, least_of_all = np.transpose(found)
    np.testing.assert_allclose(clearances, least_of_all, rtol=0.0, atol=1e-9)
    assert np.ptp(clearances) > 0.1
