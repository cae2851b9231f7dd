"""How bright pictures are, how fast that follows the light, and how much noise gain makes."""

from __future__ import annotations

import numpy as np
import pytest

from tests.drawing import needs_opengl
from tests.sim.cameras.conftest import WALL, Look
from twin.models.specs import Exposure
from twin.sim.cameras.exposure import ExposureControl

GREY = np.full((200, 200, 3), 51, np.uint8)
"""A fifth of white."""
STILL = np.zeros(GREY.shape)


def grain(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(GREY.shape)


def test_a_fixed_gain_makes_brighter_and_saturates() -> None:
    assert (ExposureControl(Exposure(gain=2.0)).exposed(GREY, STILL) == 102).all()
    assert (ExposureControl(Exposure(gain=9.0)).exposed(GREY, STILL) == 255).all()


@pytest.mark.parametrize("gain", [1.0, 4.0])
def test_noise_is_of_electrons_and_grows_with_gain(gain: float) -> None:
    config = Exposure(gain=gain, full_well=1000.0, read_noise=10.0)
    taken = ExposureControl(config).exposed(GREY, grain()).astype(float)
    electrons = np.sqrt(0.2 * 1000.0 + 10.0**2)
    assert taken.mean() == pytest.approx(51.0 * gain, abs=0.3)
    assert taken.std() == pytest.approx(255.0 * gain * electrons / 1000.0, rel=0.02)


def test_the_first_picture_is_exposed_well_and_the_next_follow_with_the_lag() -> None:
    control = ExposureControl(Exposure(target=0.4, lag=0.5))
    control.meter(GREY, 0, 1.0)
    assert control.gain == pytest.approx(2.0)
    bright = 2 * GREY
    for time_ns in range(0, 500_000_001, 100_000_000):
        control.meter(bright, time_ns, 1.0)
    assert control.gain == pytest.approx(2.0 ** np.exp(-1.0))  # a time constant after 2, on the way to 1
    again = control.gain
    control.meter(GREY, 500_000_000, 1.0)
    assert control.gain == again
    slow = ExposureControl(Exposure(target=0.4, lag=0.5))
    slow.meter(GREY, 0, 1.0)
    slow.meter(bright, 500_000_000, 1.0)
    assert slow.gain == pytest.approx(again)  # however many pictures are taken on the way


def test_gain_has_limits_and_counts_what_the_lens_lights() -> None:
    dark = ExposureControl(Exposure(target=0.4, max_gain=8.0))
    dark.meter(np.zeros_like(GREY), 0, 1.0)
    assert dark.gain == 8.0
    round_picture = ExposureControl(Exposure(target=0.4))
    round_picture.meter(GREY, 0, 0.5)
    assert round_picture.gain == pytest.approx(1.0)


@needs_opengl
def test_a_camera_takes_pictures_as_bright_as_it_is_told(camera_at: Look) -> None:
    inside = "<exposure><type>auto</type><target>0.3</target></exposure>"
    camera = camera_at(WALL, inside=inside)
    first, again = camera.look(0).colours, camera.look(0).colours
    assert first is not None
    assert again is not None
    assert (first == again).all()
    assert (first @ [0.299, 0.587, 0.114]).mean() == pytest.approx(0.3 * 255, abs=0.5)
    other = camera_at(WALL, inside=inside, seed=1).look(0).colours
    assert other is not None
    assert (first != other).any()
