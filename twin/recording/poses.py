"""Where bodies truly are, over time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.recording.columns import Chunk, sim_time, transforms
from twin.recording.extents import Stage
from twin.recording.frames import WORLD
from twin.recording.rows import Rows


class Poses(Rows[tuple[int, Array, Array]]):
    """Poses of all bodies in `/tf`; what has not moved is left out.

    A row is a time [ns], positions, shape (n, 3) [m], and orientations (w, x, y, z), shape (n, 4).
    """

    def __init__(
        self,
        names: Sequence[str],
        stage: Stage,
        bases: Sequence[int],
        tolerance: float,
    ) -> None:
        """Begin with everything unknown.

        Args:
            names: Of the n bodies.
            stage: Is told where robots were.
            bases: Which bodies are bases of robots.
            tolerance: A body has moved when a coordinate [m] or quaternion component differs by more from
                what was sent.
        """
        super().__init__()
        self._names = np.array(names, dtype=object)
        self._stage = stage
        self._bases = list(bases)
        self._tolerance = tolerance
        self._sent = np.full((len(names), 7), np.inf)

    def chunks(self, rows: list[tuple[int, Array, Array]]) -> Iterator[Chunk]:
        """Yield what has moved."""
        times, xyz, quat_wxyz = zip(*rows, strict=True)
        poses = np.concatenate((np.array(xyz), np.array(quat_wxyz)), axis=2)
        self._stage.visit(poses[:, self._bases, :3].reshape(-1, 3))
        at, bodies = np.nonzero(self._moved(poses))
        if len(at):
            kept = poses[at, bodies]
            yield transforms(
                "/tf",
                sim_time(np.array(times)[at]),
                [WORLD] * len(at),
                self._names[bodies],
                kept[:, :3],
                kept[:, [4, 5, 6, 3]],
            )

    def _moved(self, poses: Array) -> NDArray[np.bool_]:
        """Return which of poses, shape (times, n, 7), are sent, shape (times, n)."""
        before = np.concatenate((self._sent[np.newaxis], poses[:-1]))
        moved: NDArray[np.bool_] = (np.abs(poses - before) > self._tolerance).any(axis=2)
        # A body that moves all the time, or never does, is compared with the pose before; others creep.
        rests = ~(np.abs(poses - self._sent) > self._tolerance).any(axis=(0, 2))
        moved[:, rests] = False
        always = moved.all(axis=0)
        self._sent[always] = poses[-1, always]
        creeps = np.flatnonzero(~(rests | always))
        if len(creeps):
            sent = self._sent[creeps]
            for i, pose in enumerate(poses[:, creeps]):
                differs = (np.abs(pose - sent) > self._tolerance).any(axis=1)
                sent[differs] = pose[differs]
                moved[i, creeps] = differs
            self._sent[creeps] = sent
        return moved
