"""Makes the pictures of robots and an environment, or of a recording, whose name and time follow.

python docs/pictures.py runs/warehouse/1 warehouse.png 45

MuJoCo draws them without a display (EGL), the Rerun viewer the recording without a window (Vulkan).
"""

from __future__ import annotations

import os
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")

import gymnasium as gym
import mujoco
import numpy as np
from PIL import Image

from twin.convert import convert
from twin.geometry import Pose2
from twin.models import load
from twin.recording.player import screenshot
from twin.sim.robot import RobotPlacement
from twin.sim.scene import Scene
from twin.sim.world import World

DOCS = Path(__file__).parent
SIZE = (480, 360)


@dataclass(frozen=True, kw_only=True)
class Shot:
    """How a robot is looked at."""

    lookat: tuple[float, float, float]
    distance: float
    azimuth: float = 145.0
    elevation: float = -18.0
    base: str = "free"
    joints: tuple[tuple[str, float], ...] = ()
    """Joint positions [m or rad]; all others are 0."""


SHOTS = {
    "sp1s": Shot(lookat=(0.0, 0.0, 0.05), distance=0.62),
    "diff_bot": Shot(lookat=(0.0, 0.0, 0.07), distance=0.85),
    "r2d2": Shot(
        lookat=(0.0, 0.0, 0.62),
        distance=2.3,
        base="kinematic",
        joints=(("tilt", -0.2), ("swivel", 0.4), ("periscope", 0.15)),
    ),
    "jackal": Shot(lookat=(0.0, 0.0, 0.1), distance=1.15),
    "test_robot": Shot(lookat=(1.0, 4.0, 0.0), distance=15.0, elevation=-40.0, base="fixed"),
    "warehouse_bot": Shot(
        lookat=(0.1, 0.0, 0.7),
        distance=2.6,
        joints=(
            ("lift_joint", 0.5),
            ("arm_stage_1_joint", 0.2),
            ("arm_stage_2_joint", 0.2),
            ("left_finger_joint", 0.12),
            ("right_finger_joint", 0.12),
        ),
    ),
}


def draw(name: str, shot: Shot) -> Image.Image:
    """Return a picture of a robot on an empty floor."""
    conversion = convert(load(name), base=shot.base)  # type: ignore[arg-type]
    placement = RobotPlacement(name=name, conversion=conversion, pose=Pose2(0.0, 0.0, 0.0))
    world = World.compose(Scene(name="studio"), [placement], visuals=True)
    for joint, position in shot.joints:
        world.data.joint(f"{name}/{joint}").qpos[0] = position
    mujoco.mj_forward(world.model, world.data)
    world.model.vis.global_.offwidth, world.model.vis.global_.offheight = 2 * SIZE[0], 2 * SIZE[1]
    world.model.vis.headlight.ambient[:] = 0.45
    camera = mujoco.MjvCamera()
    camera.lookat[:] = shot.lookat
    camera.distance, camera.azimuth, camera.elevation = shot.distance, shot.azimuth, shot.elevation
    options = mujoco.MjvOption()
    options.geomgroup[:] = 0
    options.geomgroup[[0, 1, 2]] = 1
    with mujoco.Renderer(world.model, 2 * SIZE[1], 2 * SIZE[0]) as renderer:
        renderer.update_scene(world.data, camera, options)
        pixels = np.array(renderer.render())
    return Image.fromarray(pixels).resize(SIZE, Image.Resampling.LANCZOS)


def environment() -> Image.Image:
    """Return a picture of an environment of gymnasium."""
    env = gym.make("twin.envs:twin/DiffDriveGoal-v0", render_mode="rgb_array")
    env.reset(seed=3)
    pixels = env.render()
    env.close()
    return Image.fromarray(np.asarray(pixels))


def save(picture: Image.Image, file: Path, colours: int = 256) -> None:
    """Write a small PNG."""
    picture.convert("RGB").quantize(colours, kmeans=1, dither=Image.Dither.NONE).save(file, optimize=True)


def screen(recording: Path, file: Path, *, time_s: float, width: int = 1100) -> None:
    """Write the recording's first screen at a time, without the window's own bars."""
    with tempfile.TemporaryDirectory() as folder:
        shot = Path(folder) / "screen.png"
        screenshot(recording, shot, time_s=time_s)
        picture = Image.open(shot).crop((0, 36, 1600, 900))
    height = round(width * picture.height / picture.width)
    save(picture.resize((width, height), Image.Resampling.LANCZOS), file)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        screen(Path(sys.argv[1]), DOCS / sys.argv[2], time_s=float(sys.argv[3]))
    else:
        for robot, shot in SHOTS.items():
            save(draw(robot, shot), DOCS / "robots" / f"{robot}.png")
        save(environment(), DOCS / "gymnasium.png")
