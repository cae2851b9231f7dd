"""A camera half a metre above the floor, and what it looks at."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from twin.convert import convert
from twin.geometry import Pose3
from twin.models.loader import parse_urdf
from twin.models.shapes import Box, Sphere
from twin.sim.cameras.camera import Camera
from twin.sim.robot import RobotPlacement
from twin.sim.scene import Scene, Shape, StaticBody
from twin.sim.world import World

EYE = (0.06, 0.0, 0.5)
"""Where the camera is, in the world [m]; it looks along +x."""
URDF = """<robot name="mast"><link name="base">
<inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1"/></inertial>
<collision><geometry><box size=".1 .1 .1"/></geometry></collision></link>
<gazebo reference="base"><sensor name="camera" type="{kind}"><pose>0.06 0 0.5 0 0 0</pose>
<update_rate>{rate}</update_rate><camera>{inside}<horizontal_fov>1.2</horizontal_fov>
<image><width>160</width><height>120</height><format>{format}</format></image>
<clip><near>0.05</near><far>20</far></clip></camera></sensor></gazebo></robot>"""

Look = Callable[..., Camera]
WALL = StaticBody(
    name="wall",
    T_world_body=Pose3.from_xyz_rpy((EYE[0] + 3.05, 0.0, 0.0)),
    shapes=(Shape(geometry=Box(size=(0.1, 9.0, 9.0))),),
)
BALL_AT, BALL_RADIUS = (2.06, 0.3, 0.7), 0.2
BALL = StaticBody(
    name="ball",
    T_world_body=Pose3.from_xyz_rpy(BALL_AT),
    shapes=(Shape(geometry=Sphere(radius=BALL_RADIUS), rgba=(1.0, 0.0, 0.0, 1.0)),),
)


def built(
    *things: StaticBody,
    inside: str = "",
    kind: str = "rgbd_camera",
    format: str = "",
    seed: int = 0,
    rate: int = 10,
) -> Camera:
    """Return the camera of a world of some things."""
    description = parse_urdf(
        URDF.format(inside=inside, kind=kind, format=format, rate=rate), Path("mast.urdf")
    )
    placement = RobotPlacement(
        name="mast", conversion=convert(description, base="fixed"), pose=Pose3.from_xyz_rpy()
    )
    world = World.compose(Scene(name="room", statics=things), [placement], seed=seed)
    return world.robots["mast"].cameras[0]


@pytest.fixture
def camera_at() -> Iterator[Look]:
    """Return cameras of worlds that are closed at the end."""
    with ExitStack() as ending:

        def build(*things: StaticBody, **options: Any) -> Camera:
            camera = built(*things, **options)
            ending.callback(camera.mount.world.close)
            return camera

        yield build
