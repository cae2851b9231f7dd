"""How wrong depth cameras are, by models from the literature; both grow with the square of the distance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.models.specs import DepthNoise

KINECT = 1.425e-3
"""sigma_z / z² of the first Kinect [1/m] (Khoshelham and Elberink 2012)."""
KINECT_REACH = (0.5, 5.0)
"""Where it measures [m]."""


def deviation(z: Array, noise: DepthNoise, focal_length: float) -> Array:
    """Return the standard deviation [m] of depths [m]; `focal_length` in pixels."""
    if noise.model == "kinect":
        return KINECT * z**2
    return noise.subpixel / (focal_length * noise.baseline) * z**2


def noisy(
    z: NDArray[np.float32], noise: DepthNoise, focal_length: float, grain: Array
) -> NDArray[np.float32]:
    """Return depths [m] as measured, nan where nothing is; `grain` are standard normal numbers, as many."""
    measured = z + grain * deviation(z.astype(np.float64), noise, focal_length)
    low, high = KINECT_REACH if noise.model == "kinect" else (0.0, np.inf)
    measured[~((z > low) & (z < high) & (measured > 0.0))] = np.nan
    return measured.astype(np.float32)
