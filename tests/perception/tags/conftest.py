"""Tags that a camera looks at."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from twin.convert import convert
from twin.geometry import Pose3
from twin.models.lens import Lens
from twin.models.loader import parse_urdf
from twin.sim.looks.tags import T_TAG_PRINT
from twin.sim.robot import RobotPlacement
from twin.sim.scene import Decal, Scene
from twin.sim.world import World

URDF = """<robot name="mast"><link name="base">
<inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1"/></inertial>
<collision><geometry><box size=".1 .1 .1"/></geometry></collision></link>
<gazebo reference="base"><sensor name="camera" type="camera"><pose>0 0 1 0 0 0</pose>
<update_rate>10</update_rate><camera><horizontal_fov>1.2</horizontal_fov>
<image><width>640</width><height>480</height><format>L8</format></image>
<clip><near>0.05</near><far>20</far></clip><noise><stddev>0.007</stddev></noise>{inside}
</camera></sensor></gazebo></robot>"""
T_WORLD_CAMERA = Pose3.from_xyz_rpy((0.0, 0.0, 1.0), (-np.pi / 2.0, 0.0, -np.pi / 2.0))
"""Its optical frame: z ahead, y down."""

Photo = Callable[..., tuple[np.ndarray, Lens]]


def before_camera(distance: float, tilt: float, about: float, turn: float, aside: float = 0.0) -> Pose3:
    """Return a tag that is seen from its front at an angle `tilt`, about an axis in its plane."""
    place = Pose3.from_xyz_rpy(
        (distance * np.cos(aside), distance * np.sin(aside), 1.0), (0, 0, aside + np.pi)
    )
    rolls = [Pose3.from_xyz_rpy(rpy=(angle, 0.0, 0.0)) for angle in (about, turn)]
    return place @ rolls[0] @ Pose3.from_xyz_rpy(rpy=(0.0, 0.0, tilt)) @ rolls[1]


def error_of(seen: Pose3, T_world_tag: Pose3) -> tuple[float, float]:
    """Return how far off a pose in the optical frame is [m], and by what angle [degrees]."""
    off = (T_WORLD_CAMERA.inverse() @ T_world_tag @ T_TAG_PRINT).inverse() @ seen
    angle = 2.0 * np.arctan2(np.linalg.norm(off.quat_wxyz[1:]), abs(off.quat_wxyz[0]))
    return float(np.linalg.norm(off.xyz)), float(np.degrees(angle))


@pytest.fixture
def photo() -> Iterator[Photo]:
    """Return pictures of tags, and the lens through which they were taken."""
    with ExitStack() as ending:

        def take(*tags: Decal, seed: int = 0, inside: str = "") -> tuple[np.ndarray, Lens]:
            description = parse_urdf(URDF.format(inside=inside), Path("mast.urdf"))
            mast = RobotPlacement(
                name="mast", conversion=convert(description, base="fixed"), pose=Pose3.from_xyz_rpy()
            )
            world = World.compose(Scene(name="room", decals=tags), [mast], seed=seed)
            ending.callback(world.close)
            camera = world.robots["mast"].cameras[0]
            seen = camera.look(0).colours
            assert seen is not None
            return seen, camera.spec.lens

        yield take
