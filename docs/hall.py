"""Makes the picture of the warehouse in README: the robot carries the tote, with shadows and smooth edges.

python docs/hall.py docs/hall.png
"""

from __future__ import annotations

import sys
from pathlib import Path

import mujoco
import numpy as np
from pictures import save
from PIL import Image

from twin.runtime.open_run import OpenRun
from twin.scenario.schema import load
from twin.sim.canvas import Canvas

SCENARIOS = Path(__file__).parents[1] / "scenarios"
SIZE, ZOOM, TIME_S = (1000, 560), 2, 44.0


def hall(time_s: float) -> Image.Image:
    """Return what a visitor of the warehouse sees at a time [s]."""
    under_way = OpenRun(load(SCENARIOS / "warehouse.yaml"))
    world = under_way.run.world
    under_way.advance(lambda: world.time_ns >= time_s * 1e9)
    spec = world.spec_to_see()
    width, height = ZOOM * SIZE[0], ZOOM * SIZE[1]
    spec.visual.global_.offwidth, spec.visual.global_.offheight = width, height
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = world.data.qpos
    under_way.close()
    mujoco.mj_forward(model, data)
    view, options = mujoco.MjvCamera(), mujoco.MjvOption()
    x, y, _ = data.body("warehouse_bot/base_link").xpos
    view.lookat[:] = x - 0.7, y + 0.35, 0.62
    view.distance, view.azimuth, view.elevation = 4.2, 152.0, -17.0
    options.sitegroup[:] = 0
    scene = mujoco.MjvScene(model, model.ngeom + 100)
    scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
    mujoco.mjv_updateScene(model, data, options, None, view, mujoco.mjtCatBit.mjCAT_ALL, scene)
    canvas = Canvas(model, width, height)
    pixels = canvas.draw(scene)
    canvas.close()
    return Image.fromarray(np.asarray(pixels)).resize(SIZE, Image.Resampling.LANCZOS)


if __name__ == "__main__":
    save(hall(TIME_S), Path(sys.argv[1]), colours=128)
