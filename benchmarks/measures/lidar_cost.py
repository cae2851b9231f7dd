"""What a cloud costs: CPU time of a VLP-16's turn over that of MuJoCo alone, and how exact the quick kind is.

Rays at their own times are compared with `mj_multiRay` of the same groups, depth images with those of
`mujoco.Renderer`. They take turns in one process, so that ratios hold on a noisy machine.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")  # before MuJoCo is imported, which chooses its renderer then

import mujoco
import numpy as np
from numpy.typing import NDArray

from benchmarks.measures.camera_cost import measured
from twin.runtime.open_run import OpenRun
from twin.scenario.schema import load
from twin.sensors.multi_layer_lidar import MultiLayerLidar
from twin.sim.compose import GROUP_COLLISION, GROUP_SOLID
from twin.sim.sensors.depth_images import DepthImages

WORLDS = {
    "warehouse": "world: {arena: warehouse}",
    "near-empty room": (
        "world: {obstacles: ["
        "{name: east, size: [0.2, 8, 3], pose: {x: 5}}, {name: west, size: [0.2, 8, 3], pose: {x: -5}}, "
        "{name: north, size: [10, 0.2, 3], pose: {y: 4}}, {name: south, size: [10, 0.2, 3], pose: {y: -4}}]}"
    ),
}
PLACES = {"warehouse": "start: start", "near-empty room": "pose: {x: 0}"}
SCENARIO = """
name: lidar_cost
duration: 1 s
{world}
robots: [{{model: jackal, args: {{velodyne: true, velodyne_noise: 0.008, layers_method: {method}}}, {place}}}]
checks: [{{no_collision: {{}}}}]
"""


def open_lidar(world: str, method: str, folder: Path) -> tuple[OpenRun, MultiLayerLidar]:
    """Return a run that has not begun, and its lidar."""
    scenario = folder / "lidar_cost.yaml"
    scenario.write_text(SCENARIO.format(world=WORLDS[world], place=PLACES[world], method=method))
    run = OpenRun(load(scenario), record=False)
    sensors = run.run.world.robots["jackal"].sensors
    return run, next(sensor for sensor in sensors if isinstance(sensor, MultiLayerLidar))


def turn(lidar: MultiLayerLidar, groups: int) -> object:
    """Return a cloud."""
    period = int(1e9 / lidar.spec.rate_hz / groups)
    return [lidar.sample(period * (number + 1)) for number in range(groups)][-1]


def of_rays(world: str, rounds: int, folder: Path) -> None:
    """Print what rays at their own times cost."""
    run, lidar = open_lidar(world, "rolling", folder)
    turn(lidar, lidar.spec.groups)
    model, data = run.run.world.model, run.run.world.data
    groups = np.zeros(mujoco.mjNGROUP, np.uint8)
    groups[[GROUP_SOLID, GROUP_COLLISION]] = 1
    body = lidar.mount.body_id
    turned = [np.ravel(part @ data.xmat[body].reshape(3, 3).T) for part in lidar._parts]
    most = max(map(len, turned)) // 3
    found, distances, normals = np.zeros(most, np.int32), np.zeros(most), np.zeros(3 * most)

    def bare() -> None:
        for rays in turned:
            n = len(rays) // 3
            room = found[:n], distances[:n], normals[: 3 * n]
            mujoco.mj_multiRay(
                model, data, data.xpos[body], rays, groups, True, body, *room, n, lidar.spec.range_max
            )

    theirs_s, ours_s = measured([bare, lambda: turn(lidar, lidar.spec.groups)], rounds)
    sys.stdout.write(f"{world}, {lidar.spec.rays} rays at their own times: {theirs_s * 1e3:.1f} ms bare, ")
    sys.stdout.write(f"{ours_s * 1e3:.1f} ms here, {ours_s / theirs_s:.2f} times\n")
    run.close()


def of_images(world: str, rounds: int, folder: Path) -> None:
    """Print what depth images cost, and how far their points are from where rays end."""
    run, lidar = open_lidar(world, "depth_images", folder)
    turn(lidar, 1)
    off = errors(lidar, world, folder)
    (images,) = lidar._eyes
    assert isinstance(images, DepthImages)
    width, height = lidar.spec.image_size
    model, data = images._eyes.model, mujoco.MjData(images._eyes.model)
    data.qpos[:] = run.run.world.data.qpos
    mujoco.mj_forward(model, data)
    option = mujoco.MjvOption()
    option.geomgroup[:] = [group in (GROUP_SOLID, GROUP_COLLISION) for group in range(mujoco.mjNGROUP)]
    with mujoco.Renderer(model, height, width) as renderer:
        renderer.enable_depth_rendering()

        def bare() -> None:
            for number in range(4):
                renderer.update_scene(data, f"camera {number}.0", option)
                for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
                    renderer.scene.flags[flag] = 0
                renderer.render()

        def own() -> None:
            run.run.world.step_count += 1  # else it would know that nothing has moved
            turn(lidar, 1)

        theirs_s, ours_s = measured([bare, own], rounds)
    sys.stdout.write(f"{world}, depth images of {width} x {height}: {theirs_s * 1e3:.1f} ms bare, ")
    sys.stdout.write(f"{ours_s * 1e3:.1f} ms here, {ours_s / theirs_s:.2f} times\n")
    sys.stdout.write(
        f"{world}, against rays: median {np.median(off) * 1e3:.2g} mm, "
        f"95 % within {np.percentile(off, 95) * 1e3:.2g} mm, "
        f"{np.mean(off > 0.1) * 100:.2g} % off by more than 0.1 m\n"
    )
    run.close()


def errors(lidar: MultiLayerLidar, world: str, folder: Path) -> NDArray[np.float64]:
    """Return how far ranges of depth images are from those of rays, where both see something [m]."""
    run, rays = open_lidar(world, "instant", folder)
    seen, true = (each._look(0)[0] for each in (lidar, rays))
    run.close()
    there = np.isfinite(true) & np.isfinite(seen)
    return np.abs(seen[there] - true[there])


def main() -> None:
    """Print three lines for each world."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=60, help="median of so many (default: 60)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for world in WORLDS:
            of_rays(world, options.rounds, Path(folder))
            of_images(world, options.rounds, Path(folder))


if __name__ == "__main__":
    main()
