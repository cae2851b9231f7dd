"""How brightly a camera takes a picture: its gain, given or steered, and the noise that grows with it.

Light is counted as electrons in a pixel (EMVA 1288): as many as arrive vary by their square root, reading
them adds noise of its own, and gain amplifies both. What a picture shows as 255 without gain fills the pixel.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.models.specs import Exposure

_LIGHT = np.arange(256) / 255.0
LUMA = np.array([0.299, 0.587, 0.114])
"""ITU-R BT.601, as OpenCV weighs colours."""


class ExposureControl:
    """Exposes one picture after another; of an automatic exposure the gain follows what they show."""

    def __init__(self, config: Exposure) -> None:
        self.config = config
        self.gain = config.gain
        """Of the last picture."""
        self._time_ns: int | None = None

    def meter(self, drawn: NDArray[np.uint8], time_ns: int, lit: float) -> None:
        """Settle the gain of a picture.

        The first has the gain that it asks for. The next ones come nearer to theirs, each by the time since
        the one before; of two at one time the second changes nothing.

        Args:
            drawn: Red, green and blue as drawn, shape (height, width, 3).
            time_ns: Simulated [ns].
            lit: Which part of it the lens lights, from 0 to 1.
        """
        config, before_ns = self.config, self._time_ns
        if config.target is None or time_ns == before_ns:
            return
        light = float(drawn.mean(axis=(0, 1)) @ LUMA) / 255.0 / lit
        wanted = min(max(config.target / max(light, 1e-9), config.min_gain), config.max_gain)
        if before_ns is not None and config.lag > 0.0:
            share = -math.expm1(-abs(time_ns - before_ns) * 1e-9 / config.lag)
            wanted = self.gain * (wanted / self.gain) ** share
        self.gain, self._time_ns = wanted, time_ns

    def exposed(self, drawn: NDArray[np.uint8], grain: Array) -> NDArray[np.uint8]:
        """Return a picture as taken; what is too bright is 255.

        Args:
            drawn: As drawn.
            grain: Standard normal numbers, of its shape.
        """
        full, read = self.config.full_well, self.config.read_noise
        signal = 255.0 * self.gain * _LIGHT
        sigma = 255.0 * self.gain * np.sqrt(_LIGHT * full + read**2) / full
        taken = signal[drawn] + sigma[drawn] * grain
        return np.clip(np.rint(taken), 0.0, 255.0).astype(np.uint8)
