"""What a world looks like, for a recorder or a viewer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from twin.geometry import Pose3
from twin.models.shapes import Geometry
from twin.sim.robot import RobotPlacement
from twin.sim.scene import Rgba, Scene, StaticBody


@dataclass(frozen=True, kw_only=True)
class BodyShape:
    """One shape of one body."""

    body: str
    """Name for `World.pose`; for a moving body also in `World.body_names`."""
    geometry: Geometry
    T_body_geometry: Pose3
    rgba: Rgba
    static: bool
    """True when the body never moves (scenery)."""
    material: str = ""
    """One of `twin.sim.looks.materials`."""


def shapes(scene: Scene, robots: Sequence[RobotPlacement]) -> Iterator[BodyShape]:
    """Yield scenery, goods, placed bodies and the robots' visuals, in this order."""
    for body in (*scene.statics, *scene.goods, *scene.placed):
        for shape in body.shapes:
            yield BodyShape(
                body=body.name,
                geometry=shape.geometry,
                T_body_geometry=shape.T_body_geometry,
                rgba=shape.rgba,
                static=isinstance(body, StaticBody),
                material=shape.material,
            )
    for robot in robots:
        for link in robot.conversion.description.links.values():
            for visual in link.visuals:
                yield BodyShape(
                    body=f"{robot.name}/{link.name}",
                    geometry=visual.geometry,
                    T_body_geometry=visual.T_link_geometry,
                    rgba=visual.rgba,
                    static=False,
                )
