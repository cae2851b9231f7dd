"""What checks of maps need to know of the world: the truth at the height of a robot's lidar."""

from __future__ import annotations

from collections.abc import Iterator

from twin.models.kinematics import link_poses
from twin.models.shapes import Box
from twin.navigation.costmaps.footprint import radii
from twin.runtime.defaults.from_description import scan_lidar
from twin.runtime.stacks.robot import RobotStack
from twin.scenario.observation import Surroundings
from twin.sim.scene import Scene
from twin.warehouse.footprint import Rectangle


def surroundings(scene: Scene, stack: RobotStack) -> Surroundings:
    """Return the truth for one robot; a robot without a lidar on `scan` sees nothing.

    Args:
        scene: What never moves in it counts.
        stack: The robot.
    """
    description = stack.handle.description
    lidar = scan_lidar(description)
    solids: tuple[Rectangle, ...] = ()
    if lidar is not None:
        T_root_lidar = link_poses(description)[lidar.link]
        solids = tuple(_sections(scene, stack.context.spawn_height + float(T_root_lidar.xyz[2])))
    radius = radii(stack.footprint)[0] if len(stack.footprint) > 2 else 0.0
    return Surroundings(solids=solids, start=stack.context.start, radius=radius)


def _sections(scene: Scene, height: float) -> Iterator[Rectangle]:
    """Yield the sections of what stands still with the plane z = `height` [m]."""
    for body in scene.statics:
        for shape in body.shapes:
            if not shape.solid or not isinstance(shape.geometry, Box):
                continue
            pose = body.T_world_body @ shape.T_body_geometry
            if abs(height - pose.xyz[2]) <= shape.geometry.size[2] / 2.0:
                yield Rectangle(pose.to_pose2(), shape.geometry.size[0], shape.geometry.size[1])
