"""How wrong depth cameras are, by models from the literature.

They measure inverse depth, as a shift between two views. So errors and steps grow with the square of the
distance, and what one of the two views does not see has no depth: behind edges, beside the image, and
where the shift changes faster than views can be matched.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.models.specs import DepthNoise

KINECT = 1.425e-3
"""sigma_z / z² of the first Kinect [1/m] (Khoshelham and Elberink 2012)."""
KINECT_STEP = 2.85e-3
"""Step of its inverse depth [1/m] (the same)."""
KINECT_BASELINE = 0.075
"""From its projector to its camera [m] (the same)."""
KINECT_REACH = (0.5, 5.0)
"""Where it measures [m]."""
REALSENSE_STEPS = 32
"""Of disparity in a pixel, as a D400 puts it out."""
REALSENSE_DISPARITIES = 126
"""Pixels that a D400 searches; what is nearer has more (Grunnet-Jepsen, Sweetser and Woodfill 2018)."""
_STEEPEST = 1.0
"""Change of disparity from pixel to pixel that can be matched (Pollard, Mayhew and Frisby 1985)."""


def noisy(
    z: NDArray[np.float32], noise: DepthNoise, focal_length: float, grain: Array
) -> NDArray[np.float32]:
    """Return depths [m] as measured, nan where nothing is.

    Args:
        z: True ones, nan where nothing is, shape (height, width).
        noise: The model.
        focal_length: [pixels].
        grain: Standard normal numbers, as many.
    """
    is_kinect = noise.model == "kinect"
    scale = focal_length * (KINECT_BASELINE if is_kinect else noise.baseline)
    low, high = KINECT_REACH if is_kinect else (scale / REALSENSE_DISPARITIES, np.inf)
    sigma, step = (
        (KINECT, KINECT_STEP) if is_kinect else (noise.subpixel / scale, 1.0 / REALSENSE_STEPS / scale)
    )
    inverse = 1.0 / z.astype(np.float64)
    seen = (z > low) & (z < high) & matched(scale * inverse)
    # sigma was measured of what comes out: the steps are a part of it.
    inverse += grain * np.sqrt(max(sigma**2 - step**2 / 12.0, 0.0))
    steps = np.rint(inverse / step)
    seen &= steps > 0.0
    measured = np.full(z.shape, np.nan, np.float32)
    measured[seen] = 1.0 / (steps[seen] * step)
    return measured


def matched(disparity: Array) -> NDArray[np.bool_]:
    """Return whether what a pixel shows is found in the other view, which is to the right of it.

    Args:
        disparity: How much further to the left it is there [pixels], shape (height, width); nan where
            nothing is.
    """
    far = np.nan_to_num(disparity, nan=0.0)
    there = np.arange(far.shape[1]) - far
    # Hidden behind what is further to the right here and not there.
    nearest = np.minimum.accumulate(there[:, ::-1], axis=1)[:, ::-1]
    found: NDArray[np.bool_] = there >= 0.0
    found[:, :-1] &= there[:, :-1] < nearest[:, 1:]
    for axis in (0, 1):
        jumps = np.abs(np.diff(far, axis=axis)) > _STEEPEST
        for part in (slice(None, -1), slice(1, None)):
            found[(part,) if axis == 0 else (slice(None), part)] &= ~jumps
    return found
