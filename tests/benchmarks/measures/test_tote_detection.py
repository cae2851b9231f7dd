"""What a camera finds in pictures of shelves that MuJoCo draws, with a RealSense's noise."""

from __future__ import annotations

import math
from itertools import pairwise
from types import SimpleNamespace

import numpy as np

from benchmarks.measures.tote_detection import Goods, Tally, drawn, picture
from tests.drawing import needs_opengl
from twin.geometry import Pose2
from twin.perception.boxes.detector import BoxesConfig, ColourDepthBoxes, DepthBoxes
from twin.warehouse.arena_scene import carton_shapes, tote_shapes

OPTIONS = SimpleNamespace(width=320, noise="realsense")


@needs_opengl
def test_totes_and_cartons_are_found_in_pictures_and_an_empty_shelf_is_empty() -> None:
    size = (0.3, 0.24, 0.18)
    red = Goods(
        front=Pose2(0.6, 0.13, 0.05),
        size=size,
        shapes=tote_shapes(size, (0.78, 0.16, 0.14, 1.0)),
        touches=True,
    )
    wide = (0.3, 0.3, 0.22)
    carton = Goods(
        front=red.front @ Pose2(0.0, -0.27, 0.0), size=wide, shapes=carton_shapes(wide), touches=True
    )
    tally = Tally([])
    detector = ColourDepthBoxes(BoxesConfig())
    found = detector.detect(picture([red, carton], 0.55, OPTIONS, seed=1))
    tally.take([box for box in found if box.is_whole], [red, carton], [red, carton])
    assert (tally.missed, tally.phantoms) == (0, 0)
    position, yaw, width, height, _ = np.array(tally.errors).max(axis=0)
    assert position < 6.0
    assert yaw < 1.0
    assert max(width, height) < 8.0
    empty = picture([], 0.7, OPTIONS, seed=2)
    for kind in (DepthBoxes, ColourDepthBoxes):
        assert not [box for box in kind(BoxesConfig()).detect(empty) if box.is_whole]


def test_shelves_are_drawn_so_that_goods_that_touch_stand_flush() -> None:
    shelves = [list(drawn(np.random.default_rng(seed), 0.6)) for seed in range(20)]
    flush = [(a, b) for shelf in shelves for a, b in pairwise(shelf) if b.touches]
    assert flush
    for one, other in flush:
        between = one.front.inverse() @ other.front
        assert math.isclose(between.y, (one.size[1] + other.size[1]) / 2.0)
        assert abs(between.x) < 1e-9
        assert abs(between.yaw) < 1e-9
