"""From a Scenario to everything that a run consists of."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from secrets import token_hex
from typing import TYPE_CHECKING, Any

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.names import RemapRule
from twin.bridge.node import Node
from twin.bridge.node.options import NodeOptions
from twin.bridge.programs.factory import create_nodes
from twin.bridge.programs.ros_args import RosArguments
from twin.bridge.topics import Sample
from twin.bridge.wire.session import SessionConfig
from twin.convert import convert
from twin.errors import MapError, ScenarioError, TwinError
from twin.geometry import Pose2
from twin.models import ReadOptions, load
from twin.models.sensors import SENSORS
from twin.models.shapes import Box
from twin.runtime.defaults.drives import with_drive
from twin.runtime.obstacles import hidden_pose, standing_pose
from twin.runtime.parameter_files.unpublished_topics import warn_of_unpublished_scans
from twin.runtime.stacks.context import WHOLE, Layout, StackContext
from twin.runtime.stacks.missions import AnyMission, build_missions
from twin.runtime.stacks.robot import RobotStack
from twin.runtime.surroundings import surroundings
from twin.runtime.topics import topic_types
from twin.savings import ALL, Savings
from twin.scenario.faults import titles
from twin.scenario.localisation import AmclLocalisation
from twin.scenario.missions import PickAndPlace, Tasks
from twin.scenario.observation import CheckContext, Zone
from twin.scenario.outside import ALONE, Outside
from twin.scenario.robots import RobotConfig
from twin.scenario.schema import Scenario
from twin.scenario.world import Obstacle, TagEntry
from twin.sim.drive_check import calibrated_track_ratio
from twin.sim.looks.tags import tag_decal
from twin.sim.physics import Physics
from twin.sim.robot import RobotPlacement
from twin.sim.scene import Decal, FreeBody, PlacedBody, Scene, Shape, StaticBody
from twin.sim.world import World

if TYPE_CHECKING:
    from twin.models.description import RobotDescription
    from twin.navigation.maps.occupancy_map import OccupancyMap
    from twin.sim.battery import BatteryConfig
    from twin.warehouse.arena import Arena
    from twin.warehouse.shelf import Zone as ArenaZone

INPROC = SessionConfig()
"""No network: nobody else takes part."""
_OBSTACLE_RGBA = (0.85, 0.33, 0.10, 1.0)

_TREE_EACH = (RemapRule("/tf", "tf"), RemapRule("/tf_static", "tf_static"))
"""Each of several robots has its own tree of frames in its namespace, as nav2_bringup starts them."""


@dataclass(frozen=True, kw_only=True)
class Parts:
    """What a run consists of."""

    world: World
    bus: Bus
    clock: Clock
    stacks: Mapping[str, RobotStack]
    mission: AnyMission
    deciders: Sequence[Node]
    """The nodes of the missions."""
    checks: CheckContext
    comers: Sequence[Obstacle]
    """Obstacles that faults bring."""
    control_period_ns: int


def build(
    scenario: Scenario,
    *,
    taps: Sequence[Callable[[Sample[Any]], None]] = (),
    network: SessionConfig = INPROC,
    outside: Outside = ALONE,
    crash_folder: Path | None = None,
    savings: Savings = ALL,
    before_nodes: Callable[[World, Bus], None] | None = None,
    clock: Clock | None = None,
    layout: Layout = WHOLE,
) -> Parts:
    """Build the world, the bus and all nodes.

    Args:
        scenario: What to build.
        taps: Called for every sample, from the first one on that a node publishes while it is made.
        network: How other processes may take part.
        outside: The user's own nodes, and how the run keeps time with other processes.
        crash_folder: Where the last states go if the physics diverges.
        savings: What is not done over again.
        before_nodes: Called when the world is there, and the bus without a node.
        clock: What nodes take for the time; None: simulated time.
        layout: Which nodes of robots there are, and where.

    Raises:
        TwinError: The scenario names something that does not exist or does not fit; the bus cannot listen.
    """
    arena = None
    if scenario.world.arena is not None:
        from twin.warehouse import arena as arenas

        arena = arenas.shared(scenario.world.arena)
    starts = {robot.id: _start(robot, arena) for robot in scenario.robots}
    timestep = scenario.physics.timestep
    reading = ReadOptions(sensors=tuple(map(SENSORS.find, scenario.sensors)), execute=True)
    placements, heights, ratios, batteries = [], {}, {}, {}
    for i, robot in enumerate(scenario.robots):
        described = load(robot.model, replace(reading, args=robot.args))
        description = with_drive(described, robot, scenario.tasks)
        conversion = convert(description, base=robot.base, timestep=timestep)
        batteries[robot.id] = _battery(scenario, i, description)
        heights[robot.id] = conversion.spawn_height
        ratios[robot.id] = calibrated_track_ratio(conversion, timestep=timestep)
        placements.append(
            RobotPlacement(
                name=robot.id,
                conversion=conversion,
                pose=starts[robot.id],
                command_latency=robot.command_latency,
            )
        )
    comers = _comers(scenario)
    scene = _scene(scenario, _as_it_is(scenario, arena), comers)
    maps = _maps(scenario.robots, arena)
    world = World.compose(
        scene,
        placements,
        Physics(timestep=timestep),
        seed=scenario.seed,
        crash_folder=crash_folder,
        savings=savings,
    )
    clock = clock or Clock()
    name = network.name or (outside.session or token_hex(8) if network.networked else "twin")
    bus = Bus.of(replace(network, name=name), clock, savings=savings)
    bus.use_sim_time = clock.is_simulated
    bus.starting()
    for tap in taps:
        bus.tap(tap)
    try:
        if before_nodes is not None:
            before_nodes(world, bus)
        control_period_ns = round(scenario.physics.control_period * 1e9)
        bus.node_options = _options(scenario, layout)
        stacks = {
            robot.id: RobotStack(
                StackContext(
                    bus=bus,
                    config=robot,
                    handle=world.robots[robot.id],
                    start=starts[robot.id],
                    map=maps.get(robot.id),
                    seed=scenario.seed,
                    control_period_ns=control_period_ns,
                    spawn_height=heights[robot.id],
                    track_ratio=ratios[robot.id],
                    namespace=_namespace(scenario, robot, layout),
                    layout=layout,
                    battery=batteries[robot.id],
                )
            )
            for robot in scenario.robots
        }
        robots_nodes = len(bus.nodes)
        mission = build_missions(scenario.tasks if layout.autonomy == "all" else (), stacks, arena)
        deciders = bus.nodes[robots_nodes:]
        bus.node_options, bus.group = None, ""
        for place in outside.nodes:
            create_nodes(bus, place)
        warn_of_unpublished_scans(bus)
    except BaseException:
        bus.close()
        raise
    return Parts(
        world=world,
        bus=bus,
        clock=clock,
        stacks=stacks,
        mission=mission,
        deciders=deciders,
        checks=replace(_check_context(scenario, scene, arena, stacks), topics=partial(topic_types, bus)),
        comers=comers,
        control_period_ns=control_period_ns,
    )


def _namespace(scenario: Scenario, robot: RobotConfig, layout: Layout) -> str:
    return f"/{robot.id}" if layout.is_one_of_several or len(scenario.robots) > 1 else ""


def _options(scenario: Scenario, layout: Layout) -> NodeOptions | None:
    """Return what robots' nodes are told if several share the graph, simulated or physical ones."""
    if len(scenario.robots) == 1 and not (layout.hardware or layout.is_one_of_several):
        return None
    rules = []
    if layout.commands:
        spaces = [_namespace(scenario, robot, layout) for robot in scenario.robots]
        rules = [
            RemapRule(f"{space}/cmd_vel", f"{layout.hardware}{space}/{layout.commands}") for space in spaces
        ]
    return NodeOptions(arguments=RosArguments(remappings=(*_TREE_EACH, *rules)))


def _battery(scenario: Scenario, index: int, description: RobotDescription) -> BatteryConfig | None:
    """Return the battery of a robot, if its file or the scenario speaks of one."""
    given = scenario.robots[index].battery
    if given is None and description.battery is None:
        return None
    from twin.runtime.defaults.battery import battery_config

    try:
        return battery_config(description.battery, given)
    except ScenarioError as wrong:
        message = f"battery of robot '{scenario.robots[index].id}': {wrong}"
        raise ScenarioError(scenario.source.problem(("robots", index, "battery"), message)) from None


def _start(robot: RobotConfig, arena: Arena | None) -> Pose2:
    if robot.pose is not None:
        return robot.pose.pose
    if robot.start is None:
        return Pose2(0.0, 0.0, 0.0)
    assert arena is not None  # as the scenario's checks say
    return arena.pose(robot.start)


def _as_it_is(scenario: Scenario, arena: Arena | None) -> Arena | None:
    """Return the arena that is built, which need not be the one that robots and maps know of."""
    for i, fault in enumerate(scenario.faults):
        if fault.kind == "displacement" and arena is not None:
            try:
                arena = arena.with_moved(fault.given["name"], fault.given["by"].pose)
            except TwinError as wrong:
                raise ScenarioError(
                    scenario.source.problem(("faults", i, "displacement", "name"), str(wrong))
                ) from None
    return arena


def _comers(scenario: Scenario) -> list[Obstacle]:
    """Return the obstacles that faults bring, by the names of the faults."""
    named = zip(scenario.faults, titles(scenario.faults), strict=True)
    found = [(entry.resolved()[1], name) for entry, name in named if entry.kind in ("person", "pallet")]
    return [config.obstacle(name) for config, name in found]


def _scene(scenario: Scenario, arena: Arena | None, comers: Sequence[Obstacle]) -> Scene:
    obstacles = [_obstacle(obstacle) for obstacle in scenario.world.obstacles]
    obstacles += [_obstacle(comer, hidden=True) for comer in comers]
    statics = [o for o in obstacles if isinstance(o, StaticBody)]
    movable = [o for o in obstacles if isinstance(o, FreeBody)]
    placed = tuple(o for o in obstacles if isinstance(o, PlacedBody))
    tags = tuple(map(_tag, scenario.world.tags))
    if arena is None:
        return Scene(
            name=scenario.name,
            statics=tuple(statics),
            goods=tuple(movable),
            placed=placed,
            decals=tags,
            shadows=scenario.world.shadows,
        )
    carriers = (mission for mission in scenario.tasks if isinstance(mission, PickAndPlace))
    totes = [task.tote for mission in carriers for task in mission.tasks]
    if any(isinstance(mission, Tasks) for mission in scenario.tasks):
        totes += arena.totes  # others may ask for each
    given = {good.name: good.properties for good in scenario.world.goods}
    scene = arena.scene({*given, *totes}, seed=scenario.seed, obstacles=statics)
    goods = [replace(good, **given.get(good.name, {})) for good in scene.goods]
    return replace(
        scene,
        goods=(*goods, *movable),
        placed=placed,
        decals=(*scene.decals, *tags),
        shadows=scenario.world.shadows,
    )


def _obstacle(obstacle: Obstacle, *, hidden: bool = False) -> StaticBody | FreeBody | PlacedBody:
    hidden = hidden or obstacle.appears_within is not None
    pose = hidden_pose(obstacle) if hidden else standing_pose(obstacle)
    shapes = (Shape(geometry=Box(size=obstacle.size), rgba=_OBSTACLE_RGBA),)
    name, friction = obstacle.name, obstacle.friction
    if obstacle.mass is not None:
        return FreeBody(name=name, T_world_body=pose, shapes=shapes, mass=obstacle.mass, friction=friction)
    moves = hidden or obstacle.route is not None
    kind = PlacedBody if moves else StaticBody
    return kind(name=name, T_world_body=pose, shapes=shapes, friction=friction)


def _tag(entry: TagEntry) -> Decal:
    return tag_decal(
        name=entry.title, family=entry.family, number=entry.id, size=entry.size, T_world_tag=entry.pose.pose
    )


def _maps(robots: Sequence[RobotConfig], arena: Arena | None) -> dict[str, OccupancyMap]:
    """Return the maps on which robots localise; those that are given the same one share it."""
    named = {
        robot.id: robot.localisation.map
        for robot in robots
        if isinstance(robot.localisation, AmclLocalisation)
    }
    read = {name: _map(name, arena) for name in dict.fromkeys(named.values())}
    return {robot: read[name] for robot, name in named.items()}


def _map(name: str | None, arena: Arena | None) -> OccupancyMap:
    """Return a map by its name or path, or that of the arena.

    Raises:
        MapError: It cannot be read, or does not cover the arena.
    """
    from twin.navigation.maps.occupancy_map import OccupancyMap
    from twin.warehouse.map_files import map_of_arena, named_map

    if name is None:
        assert arena is not None  # as the scenario's checks say
        return map_of_arena(arena)
    path = named_map(name)
    grid = OccupancyMap.load(path)
    if arena is not None:
        height, width = grid.data.shape
        hall = arena.file.hall
        x0, y0 = grid.origin.x, grid.origin.y
        x1, y1 = x0 + width * grid.resolution, y0 + height * grid.resolution
        if max(x0 - hall.x[0], y0 - hall.y[0], hall.x[1] - x1, hall.y[1] - y1) > 2.0 * grid.resolution:
            raise MapError(
                f"{path}: the map covers x {x0:.2f} … {x1:.2f}, y {y0:.2f} … {y1:.2f} m, but the arena "
                f"'{arena.name}' spans x {hall.x[0]:g} … {hall.x[1]:g}, y {hall.y[0]:g} … {hall.y[1]:g} m"
            )
    return grid


def _check_context(
    scenario: Scenario, scene: Scene, arena: Arena | None, stacks: Mapping[str, RobotStack]
) -> CheckContext:
    bottoms = {
        good.name: max(
            (_half_height(shape) - float(shape.T_body_geometry.xyz[2]) for shape in good.shapes), default=0.0
        )
        for good in scene.goods
    }
    return CheckContext(
        robots=tuple(stacks),
        zones={} if arena is None else {name: _zone(zone) for name, zone in arena.zones.items()},
        good_bottoms=bottoms,
        surroundings={name: surroundings(scene, stack) for name, stack in stacks.items()},
    )


def _zone(zone: ArenaZone) -> Zone:
    if (table := zone.table) is None:
        return Zone(centre=zone.pose, size=(zone.area.size_x, zone.area.size_y))
    return Zone(centre=table.pose, size=(table.depth, table.length), height=table.levels[0])


def _half_height(shape: Shape) -> float:
    return shape.geometry.size[2] / 2.0 if isinstance(shape.geometry, Box) else math.nan
