"""Compile (or load from the disk cache) every compiled function before the clock starts."""

from __future__ import annotations

import contextlib

import numpy as np

from twin.geometry import Pose2
from twin.navigation.control.collision_monitor import time_to_collision
from twin.navigation.control.controller import Controller
from twin.navigation.costmaps.costmap import footprint_cost
from twin.navigation.costmaps.filters import KeepoutFilter
from twin.navigation.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from twin.navigation.exploration.explorer import Explorer
from twin.navigation.failures import ControlFailure
from twin.navigation.localisation.laser_scan import chosen_beams
from twin.navigation.localisation.likelihood_field import LikelihoodField
from twin.navigation.localisation.particles import clusters, regularised, tempered_weights
from twin.navigation.localisation.surface_distance import SurfaceDistance
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.navigation.planning.planner import Planner, ThetaStarConfig
from twin.navigation.planning.smoother import SimpleSmoother
from twin.navigation.recovery import DriveOnHeading


def warm_up() -> None:
    """Call each compiled function once on a 2 x 2 m room with the types that it is called with later."""
    data = np.zeros((40, 40), dtype=np.int8)
    data[0] = data[-1] = 100
    room = OccupancyMap(data=data, resolution=0.05, origin=Pose2(0.0, 0.0, 0.0))
    layered = LayeredCostmap(config=CostmapConfig(robot_radius=0.1), static_map=room)
    layered.update([[0.5, 1.0]], (1.0, 1.0), Pose2(1.0, 1.0, 0.0))
    layered.update_range(Pose2(1.0, 1.0, 0.0), 0.3, (0.1, 0.5), 0.2)
    layered.set_keepout(KeepoutFilter(mask=room))
    costmap = layered.costmap
    start, goal = Pose2(1.0, 0.5, 0.0), Pose2(1.5, 1.5, 0.0)
    SimpleSmoother().smooth(Planner(config=ThetaStarConfig()).plan(costmap, start, goal), costmap)
    footprint_cost(costmap, layered.config.polygon, start)
    DriveOnHeading().update(start, 0.1, costmap)
    time_to_collision(np.ones((2, 2)), layered.config.polygon, 0.1, 0.1, 0.1, 0.1, 1)
    Explorer().update(room, start, 0.0)
    _localise(room)


def _localise(room: OccupancyMap) -> None:
    beams = chosen_beams([0.5, 0.6], [0.0, 1.0], Pose2(0.0, 0.0, 0.0), most=2, min_range=0.0, max_range=9.0)
    field = LikelihoodField(SurfaceDistance(room, max_dist=2.0), z_hit=0.5, z_rand=0.5)
    field.log_likelihood(np.ones((2, 3)), beams, 0.0, 0.1)
    regularised(np.ones((2, 3)), clusters(np.ones((2, 3))), np.ones((2, 3)))
    tempered_weights(np.zeros(2), np.zeros(2), 1.0)


def warm_up_controller(controller: Controller) -> None:
    """Let a controller drive a few commands along a path that bends and ends, and forget them."""
    data = np.zeros((80, 80), dtype=np.int8)
    data[30, 40] = 100
    room = OccupancyMap(data=data, resolution=0.05, origin=Pose2(0.0, 0.0, 0.0))
    costmap = LayeredCostmap(config=CostmapConfig(robot_radius=0.1), static_map=room).costmap
    path = np.column_stack([np.linspace(0.5, 3.5, 31), np.full(31, 2.0), np.zeros(31)])
    for x, yaw in ((0.5, 0.0), (0.5, 1.5), (3.3, 0.0)):
        with contextlib.suppress(ControlFailure):
            controller.compute_velocity(Pose2(x, 2.0, yaw), (0.0, 0.0), path, costmap, 0.05)
    controller.reset()
