"""How well each controller follows a planned path, and what a command costs next to regulated pure pursuit's.

`make bench` prints it. A unicycle with the warehouse robot's limits and a lag of 0.1 s drives through a hall
of walls and pillars; every controller has the parameters of the runtime. CPU times are ratios within a run.
"""

from __future__ import annotations

import math
import time
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from twin.controllers.limiter import AxisLimits
from twin.controllers.velocity_smoother import VelocitySmoother, VelocitySmootherConfig
from twin.geometry import Pose2, wrap_angle
from twin.navigation.control.controller import Controller
from twin.navigation.costmaps.costmap import Costmap, footprint_cost
from twin.navigation.costmaps.footprint import rectangle
from twin.navigation.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.navigation.planning.config import PlannerConfig
from twin.navigation.planning.planner import Planner
from twin.navigation.planning.smoother import SimpleSmoother
from twin.navigation.plugins import CONTROLLERS, create
from twin.navigation.warm_up import warm_up_controller
from twin.runtime.defaults.controllers import controller_server_config
from twin.scenario.controllers import ControllerParameters

DT, LAG, WINDOW = 0.06, 0.1, 2.0
FOOTPRINT = rectangle(0.42, 0.33)
LIMITS = VelocitySmootherConfig(
    linear=AxisLimits(max_velocity=1.0, max_acceleration=0.8, max_deceleration=1.2),
    angular=AxisLimits(max_velocity=1.5, max_acceleration=2.0, max_deceleration=3.0),
)
START, GOAL = Pose2(1.5, 1.0, 1.57), Pose2(10.5, 1.5, -1.57)


class Result(NamedTuple):
    """One drive."""

    seconds: float
    rms: float
    """Distance from the path [m]."""
    largest: float
    jerkiness: float
    """Rms of the change of the commanded turn rate [rad/s²]."""
    clearance: float
    """Least distance of the base from an obstacle [m]."""
    collided: bool
    arrived: bool
    command_us: float


def hall() -> Costmap:
    """Return 12 x 8 m with three walls to go around and two pillars."""
    data = np.zeros((160, 240), dtype=np.int8)
    data[:2] = data[-2:] = data[:, :2] = data[:, -2:] = 100  # type: ignore[assignment]
    for rows, columns in (
        ((0, 100), (60, 64)),
        ((60, 160), (120, 124)),
        ((0, 100), (180, 184)),
        ((128, 134), (86, 92)),
        ((25, 31), (150, 156)),
    ):
        data[slice(*rows), slice(*columns)] = 100
    room = OccupancyMap(data=data, resolution=0.05, origin=Pose2(0.0, 0.0, 0.0))
    polygon = tuple((float(x), float(y)) for x, y in FOOTPRINT)
    config = CostmapConfig(footprint=polygon, inflation_radius=0.8, cost_scaling_factor=4.0)
    return LayeredCostmap(config=config, static_map=room).costmap


def around(costmap: Costmap, pose: Pose2) -> Costmap:
    """Return what a rolling costmap would hold."""
    column, row = costmap.world_to_cell(pose.x, pose.y)
    reach = round(WINDOW / costmap.resolution)
    x, y = max(0, column - reach), max(0, row - reach)
    return Costmap(
        costs=np.ascontiguousarray(costmap.costs[y : row + reach, x : column + reach]),
        resolution=costmap.resolution,
        origin=(x * costmap.resolution, y * costmap.resolution),
        inscribed_radius=costmap.inscribed_radius,
        cost_scaling_factor=costmap.cost_scaling_factor,
    )


def drive(controller: Controller, costmap: Costmap, path: np.ndarray) -> Result:
    """Drive the path once."""
    warm_up_controller(controller)
    smoother = VelocitySmoother(LIMITS)
    pose, v, w, cpu, there, arrived = START, 0.0, 0.0, 0, False, False
    poses, turns = [pose], []
    while not arrived and len(poses) * DT < 90.0:
        local = around(costmap, pose)
        began = time.process_time_ns()
        command = controller.compute_velocity(pose, (v, w), path, local, DT)
        cpu += time.process_time_ns() - began
        smoother.set_command(*command)
        for _ in range(3):
            h = DT / 3.0
            v_target, w_target = smoother.update(h)
            v, w = v + (v_target - v) * h / LAG, w + (w_target - w) * h / LAG
            pose = pose @ Pose2(v * h * np.sinc(w * h / (2 * np.pi)), 0.0, 0.0) @ Pose2(0.0, 0.0, w * h)
        poses.append(pose)
        turns.append(command[1])
        there |= pose.distance(GOAL) < 0.05
        arrived = there and abs(wrap_angle(pose.yaw - path[-1, 2])) < 0.05
    track = np.array(poses)
    fine = np.concatenate([np.linspace(a, b, 20) for a, b in zip(path[:-1, :2], path[1:, :2], strict=True)])
    off = cKDTree(fine).query(track[:, :2])[0]
    lethal = costmap.cell_to_world(np.argwhere(costmap.costs == 254)[:, ::-1])
    return Result(
        seconds=len(turns) * DT,
        rms=float(np.sqrt(np.mean(off**2))),
        largest=float(off.max()),
        jerkiness=float(np.sqrt(np.mean((np.diff(turns) / DT) ** 2))),
        clearance=float(cKDTree(lethal).query(track[:, :2])[0].min()),
        collided=any(footprint_cost(costmap, FOOTPRINT, Pose2(*at)) == 254 for at in track),
        arrived=bool(arrived),
        command_us=cpu / len(turns) / 1e3,
    )


def results() -> dict[str, Result]:
    """Drive with every plugin."""
    costmap = hall()
    plan = Planner(config=PlannerConfig()).create_plan(costmap, START, GOAL)
    path = SimpleSmoother().smooth(plan, costmap)
    found = {}
    for plugin in ("regulated_pure_pursuit", "dwb", "mppi"):
        parameters = ControllerParameters(plugin=plugin)  # type: ignore[arg-type]
        config = controller_server_config(parameters, LIMITS).controllers["FollowPath"]
        controller = create(CONTROLLERS, config, footprint=FOOTPRINT)
        controller.set_goal_tolerance(0.05)
        found[plugin] = drive(controller, costmap, path)
    return found


def main() -> None:
    """Print one table."""
    found = results()
    base = found["regulated_pure_pursuit"].command_us
    print(f"a path of 3 corners, {DT * 1e3:.0f} ms per command")
    heads = ("time s", "rms cm", "max cm", "dw rad/s²", "clear m", "µs", "x RPP", "% of real time")
    print(f"{'':24}" + "".join(f"{head:>{max(9, len(head) + 2)}}" for head in heads))
    for name, one in found.items():
        cells = (
            f"{one.seconds:.1f}" if one.arrived else "never",
            f"{one.rms * 100:.1f}",
            f"{one.largest * 100:.1f}",
            f"{one.jerkiness:.2f}",
            "hit" if one.collided else f"{one.clearance:.2f}",
            f"{one.command_us:.0f}",
            f"{one.command_us / base:.1f}",
            f"{one.command_us / DT / 1e4:.2f}",
        )
        line = "".join(f"{cell:>{max(9, len(head) + 2)}}" for cell, head in zip(cells, heads, strict=True))
        print(f"{name:24}{line}")
    assert not any(math.isnan(one.rms) for one in found.values())


if __name__ == "__main__":
    main()
