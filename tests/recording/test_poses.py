"""Which poses are sent: those that differ from what was sent before, whatever moves beside them."""

from __future__ import annotations

import numpy as np
import pytest

from twin.recording.extents import Stage
from twin.recording.poses import Poses

TOLERANCE = 1e-4


class NoStage(Stage):
    def __init__(self) -> None:
        self._reach = 0.0
        self._low = self._high = np.zeros(2)


def kept(poses: np.ndarray, blocks: list[int]) -> list[tuple[int, str, list[float]]]:
    """Return time, body and x of every row in blocks of so many samples."""
    names = [f"b{i}" for i in range(poses.shape[1])]
    sender = Poses(names, NoStage(), [0], TOLERANCE)
    rows = [(i, pose[:, :3], pose[:, 3:]) for i, pose in enumerate(poses)]
    found = []
    for n in blocks:
        block, rows = rows[:n], rows[n:]
        for _, times, (xyz, _, _, child) in sender.chunks(block):
            at = times.as_arrow_array().cast("int64").to_pylist()
            x = [row[0][0] for row in xyz.as_arrow_array().to_pylist()]
            bodies = [row[0] for row in child.as_arrow_array().to_pylist()]
            found += zip(at, bodies, x, strict=True)
    assert not rows
    return found


def expected(poses: np.ndarray) -> list[tuple[int, str, list[float]]]:
    """The same, body by body and sample by sample."""
    found = []
    sent = np.full(poses.shape[1:], np.inf)
    for i, bodies in enumerate(poses):
        for k, pose in enumerate(bodies):
            if np.abs(pose - sent[k]).max() > TOLERANCE:
                sent[k] = pose
                found.append((i, f"b{k}", float(np.float32(pose[0]))))
    return found


@pytest.mark.parametrize("blocks", [[40], [1, 39], [10, 10, 20], [1] * 40])
def test_a_pose_is_sent_if_it_differs_from_the_one_sent_before(blocks: list[int]) -> None:
    """One body drives, one rests, one creeps, one starts, one trembles, one turns and comes back."""
    rng = np.random.default_rng(1)
    t = np.arange(40.0)
    poses = np.zeros((40, 6, 7))
    poses[:, 0, 0] = 0.01 * t
    poses[:, 2, 0] = 0.3 * TOLERANCE * t
    poses[:, 3, 0] = 0.01 * np.maximum(t - 17, 0)
    poses[:, 4, :3] = 0.8 * TOLERANCE * rng.standard_normal((40, 3))
    poses[:, 5, 3] = np.where(t % 9 == 4, 2 * TOLERANCE, 0.0)
    assert kept(poses, blocks) == expected(poses)
