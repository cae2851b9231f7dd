"""Compile (or load from the disk cache) what a node runs, before the clock starts.

Each node calls its own function when it is built: a robot that does not explore waits for no explorer, and
nobody for anything in a run that is as fast as possible (`ahead.py`). A function calls what is compiled with
the types that it is called with later, in a room of 2 x 2 m, once per process; it imports that itself, for it
is imported by nodes that need but one of them.
"""

from __future__ import annotations

import contextlib
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from twin.geometry import Pose2
from twin.navigation.ahead import ahead
from twin.navigation.failures import ControlFailure
from twin.navigation.maps.occupancy_map import OccupancyMap

if TYPE_CHECKING:
    from twin.navigation.control.controller import Controller
    from twin.navigation.costmaps.layered_costmap import LayeredCostmap

_START, _GOAL = Pose2(1.0, 0.5, 0.0), Pose2(1.5, 1.5, 0.0)


@ahead
@cache
def warm_up_costmap() -> None:
    """Let a scan into a costmap."""
    _costmap().update([[0.5, 1.0]], (1.0, 1.0), Pose2(1.0, 1.0, 0.0))


@ahead
@cache
def warm_up_voxels() -> None:
    """Let a cloud into both layers that take one."""
    from twin.navigation.costmaps.observation import Observation, ObservationSource

    layered, points = _costmap(), np.array([[0.5, 1.0, 0.5]])
    for layer in ("voxel_layer", "obstacle_layer"):
        source = ObservationSource(topic="points", layer=layer, clearing=True)
        seen = Observation(points=points, sensor=(1.0, 1.0, 0.5), source=source)
        layered.observe([seen], Pose2(1.0, 1.0, 0.0))


@ahead
@cache
def warm_up_odometry_watch() -> None:
    """Let scans of a corner contradict odometry, so that their motion is looked for."""
    from twin.navigation.odometry_watch import OdometryWatch

    along = np.linspace(0.0, 1.0, 30)
    corner = np.column_stack([np.minimum(2.0 * along, 1.0), np.minimum(2.0 - 2.0 * along, 1.0)])
    watch = OdometryWatch()
    watch.take(lambda: corner, Pose2(0.0, 0.0, 0.0), 0)
    watch.take(lambda: corner, Pose2(0.0, 0.0, 1.0), 500_000_000)


@ahead
@cache
def warm_up_ranges() -> None:
    """Let a reading of a range sensor into a costmap."""
    _costmap().update_range(Pose2(1.0, 1.0, 0.0), 0.3, (0.1, 0.5), 0.2)


@ahead
@cache
def warm_up_keepout() -> None:
    """Lay a mask over a costmap."""
    from twin.navigation.costmaps.filters import KeepoutFilter

    _costmap().set_keepout(KeepoutFilter(mask=_room()))


@ahead
@cache
def warm_up_planning() -> None:
    """Plan, smooth and check a path, and its goal.

    The planners that search in all headings compile when they first plan.
    """
    from twin.navigation.costmaps.kernels import footprint_hits
    from twin.navigation.planning.path_validity import blocked_poses
    from twin.navigation.planning.planner import ThetaStar
    from twin.navigation.planning.smoother import SimpleSmoother

    layered = _costmap()
    costmap = layered.costmap
    path = SimpleSmoother().smooth(ThetaStar().create_plan(costmap, _START, _GOAL), costmap)
    blocked_poses(path, _START, costmap, costmap, layered.config.polygon)
    footprint_hits(costmap.costs, layered.config.polygon, (1.0, 1.0, 0.0), costmap.frame)


@ahead
@cache
def warm_up_reach() -> None:
    """Look what can be reached."""
    from twin.navigation.exploration.wavefront import travel_distances

    travel_distances(np.ones((2, 2), dtype=np.bool_), np.full((2, 2), np.inf))


@ahead
@cache
def warm_up_maneuver() -> None:
    """Look for a way on to a path, and begin to drive it."""
    from twin.navigation.control.maneuver import Maneuver

    layered, at, path = _costmap(), Pose2(1.0, 1.0, 0.0), np.array([[1.0, 1.0, 0.0], [1.5, 1.0, 0.0]])
    maneuver = Maneuver(footprint=layered.config.polygon)
    maneuver.begin(layered.costmap, at, path)
    maneuver.command(at, (0.0, 0.0), layered.costmap, 0.05)


@ahead
@cache
def warm_up_behaviors() -> None:
    """Look whether a command collides."""
    from twin.navigation.costmaps.costmap import footprint_cost
    from twin.navigation.recovery import DriveOnHeading

    layered = _costmap()
    footprint_cost(layered.costmap, layered.config.polygon, _START)
    DriveOnHeading().update(_START, 0.1, layered.costmap)


@ahead
@cache
def warm_up_collision_monitor() -> None:
    """Look when two points are hit."""
    from twin.navigation.control.collision_monitor import time_to_collision

    time_to_collision(np.ones((2, 2)), _costmap().config.polygon, 0.1, 0.1, 0.1, 0.1, 1)


@ahead
@cache
def warm_up_docking() -> None:
    """Look for a wall."""
    from twin.navigation.docking.faces import fit_wall

    fit_wall(np.column_stack([np.ones(5), np.linspace(0.0, 1.0, 5)]))


@cache
def warm_up_exploration() -> None:
    """Look for what there is to explore."""
    from twin.navigation.exploration.explorer import Explorer

    Explorer().update(_room(), _START, 0.0)


@ahead
@cache
def warm_up_localisation() -> None:
    """Weigh two particles by a scan. The beam model compiles when it is first used."""
    from twin.navigation.localisation.evidence import same_surface
    from twin.navigation.localisation.laser_scan import chosen_beams
    from twin.navigation.localisation.likelihood_field import LikelihoodField
    from twin.navigation.localisation.particles import clusters, regularised, tempered_weights
    from twin.navigation.localisation.surface_distance import SurfaceDistance

    beams = chosen_beams([0.5, 0.6], [0.0, 1.0], Pose2(0.0, 0.0, 0.0), most=2, min_range=0.0, max_range=9.0)
    field = LikelihoodField(SurfaceDistance(_room(), max_dist=2.0), z_hit=0.5, z_rand=0.5)
    field.log_likelihood(np.ones((2, 3)), beams, 0.0, 0.1)
    regularised(np.ones((2, 3)), clusters(np.ones((2, 3))), np.ones((2, 3)))
    tempered_weights(np.zeros(2), np.zeros(2), 1.0, 1.0)
    same_surface(np.ones((2, 2)), np.asfortranarray(np.ones((2, 2))), 0.05)


@ahead
def warm_up_controller(controller: Controller) -> None:
    """Let a controller drive a few commands along a path that bends and ends, and forget them."""
    from twin.navigation.costmaps.layered_costmap import CostmapConfig, LayeredCostmap

    data = np.zeros((80, 80), dtype=np.int8)
    data[30, 40] = 100
    room = OccupancyMap(data=data, resolution=0.05, origin=Pose2(0.0, 0.0, 0.0))
    costmap = LayeredCostmap(config=CostmapConfig(robot_radius=0.1), static_map=room).costmap
    path = np.column_stack([np.linspace(0.5, 3.5, 31), np.full(31, 2.0), np.zeros(31)])
    for x, yaw in ((0.5, 0.0), (0.5, 1.5), (3.3, 0.0)):
        with contextlib.suppress(ControlFailure):
            controller.compute_velocity(Pose2(x, 2.0, yaw), (0.0, 0.0), path, costmap, 0.05)
    controller.reset()


def _room() -> OccupancyMap:
    data = np.zeros((40, 40), dtype=np.int8)
    data[0] = data[-1] = 100
    return OccupancyMap(data=data, resolution=0.05, origin=Pose2(0.0, 0.0, 0.0))


def _costmap() -> LayeredCostmap:
    from twin.navigation.costmaps.layered_costmap import CostmapConfig, LayeredCostmap

    return LayeredCostmap(config=CostmapConfig(robot_radius=0.1), static_map=_room())
