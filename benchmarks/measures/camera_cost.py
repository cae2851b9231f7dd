"""What a picture costs: CPU time of a camera's over that of MuJoCo's own renderer, of the same model.

Both draw in turns without shadows, in one process, so that the ratio holds on a noisy machine.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")  # before MuJoCo is imported, which chooses its renderer then

import mujoco

from twin.runtime.open_run import OpenRun
from twin.scenario.schema import load
from twin.sim.cameras.camera import Camera
from twin.sim.cameras.eyes import Eyes

SIZES = (320, 240), (640, 480)
WORLD = """
name: camera_cost
duration: 1 s
world: {arena: warehouse}
robots: [{model: diff_bot, args: {camera: rgbd_camera}, pose: {x: 3, y: 3, yaw: 0.6}}]
checks: [{no_collision: {}}]
"""


def measured(ways: list[Callable[[], object]], rounds: int) -> list[float]:
    """Return the median CPU time of each [s]; they take turns."""
    spent: list[list[float]] = [[] for _ in ways]
    for number in range(rounds + 3):
        for way, times in zip(ways, spent, strict=True):
            began = time.process_time()
            way()
            if number >= 3:
                times.append(time.process_time() - began)
    return [statistics.median(times) for times in spent]


def main() -> None:
    """Print a line for each size and kind of picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=60, help="median of so many (default: 60)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scenario = Path(folder) / "camera_cost.yaml"
        scenario.write_text(WORLD)
        run = OpenRun(load(scenario), record=False)
    world = run.run.world
    (first,) = world.robots["diff_bot"].cameras
    for width, height in SIZES:
        camera = Camera(replace(first.spec, width=width, height=height, noise_stddev=0.0), first.mount)
        eyes = Eyes(world, world.spec_to_see(), [camera])
        data = mujoco.MjData(eyes.model)
        data.qpos[:] = world.data.qpos
        mujoco.mj_forward(eyes.model, data)
        with mujoco.Renderer(eyes.model, height, width) as renderer:
            for depth in (False, True):
                if depth:
                    renderer.enable_depth_rendering()

                def bare(renderer: mujoco.Renderer = renderer, data: mujoco.MjData = data) -> None:
                    renderer.update_scene(data, "camera 0.0")
                    for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
                        renderer.scene.flags[flag] = 0
                    renderer.render()

                def own(eyes: Eyes = eyes, camera: Camera = camera, depth: bool = depth) -> None:
                    eyes.look(camera, colours=not depth, depth=depth)

                theirs_s, ours_s = measured([bare, own], options.rounds)
                what = f"{width} x {height} {'depth' if depth else 'colours'}"
                sys.stdout.write(f"{what}: {theirs_s * 1e3:.1f} ms bare, {ours_s * 1e3:.1f} ms here, ")
                sys.stdout.write(f"{ours_s / theirs_s:.2f} times\n")
        eyes.close()
    run.close()


if __name__ == "__main__":
    main()
