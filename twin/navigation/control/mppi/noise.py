"""The noise of the rollouts: drawn once, used again and again."""

from __future__ import annotations

import math

import numpy as np

from twin.navigation.control.footprint_cover import F32
from twin.navigation.control.mppi.config import MPPIConfig

_BLOCKS = 8
"""So many different noises are drawn for `regenerate_noises`."""


class NoiseBank:
    """Noise of vx and wz for a batch of rollouts; a function of the parameters, seed included.

    Every draw is there with all four pairs of signs: the noise has no mean, which the same noise in every
    cycle would add up to a turn on a straight path, or to a slower drive. The first rollouts are no noise but
    what `MPPI` puts there.
    """

    def __init__(self, config: MPPIConfig) -> None:
        generator = np.random.Generator(np.random.Philox(config.seed))
        blocks = _BLOCKS if config.regenerate_noises else 1
        batch, quarter = config.batch_size, (config.batch_size + 3) // 4
        drawn = generator.standard_normal((blocks, 2, config.time_steps, quarter), dtype=np.float32)
        keep = math.exp(-config.model_dt / config.noise_time_constant) if config.noise_time_constant else 0.0
        for t in range(1, config.time_steps):
            drawn[:, :, t] = keep * drawn[:, :, t - 1] + math.sqrt(1.0 - keep * keep) * drawn[:, :, t]
        # The price is u' S^-1 e: slow noise has by this factor less weight in S^-1 than white noise.
        price = config.gamma * (1.0 - keep) / (1.0 + keep)
        self.gains: F32 = np.array([price / config.vx_std**2, price / config.wz_std**2], dtype=np.float32)
        """What `average` charges for the noise of vx and wz."""
        drawn[:, 0] *= config.vx_std
        drawn[:, 1] *= config.wz_std
        signs = np.array([(1, 1), (-1, -1), (1, -1), (-1, 1)], dtype=np.float32)
        mirrored = [drawn * pair[None, :, None, None] for pair in signs]
        self._blocks: F32 = np.ascontiguousarray(np.concatenate(mirrored, axis=-1)[..., :batch])
        self._next = 0

    def draw(self) -> F32:
        """Return the next noise, shape (2, time_steps, batch_size), and its first columns to write to."""
        block = self._blocks[self._next]
        self._next = (self._next + 1) % len(self._blocks)
        return block

    def reset(self) -> None:
        """Begin with the first block again."""
        self._next = 0
