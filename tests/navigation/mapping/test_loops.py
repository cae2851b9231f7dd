"""A place that odometry is sure of is one again at once if what is seen there fits, and never if not."""

from __future__ import annotations

import numpy as np
import pytest

from tests.navigation.mapping.worlds import ANGLES, LIDAR, WALLS, ring, scan
from twin.geometry import Array
from twin.navigation.mapping.config import SlamConfig
from twin.navigation.mapping.loop_closing import LoopCloser
from twin.navigation.mapping.mapped_scans import MappedScans
from twin.navigation.mapping.scan import Scan

CONFIG = SlamConfig(scan_buffer_size=6, loop_match_minimum_chain_size=3, loop_search_space_dimension=2.0)
STEP = np.diag([1e-5, 1e-5, 1e-7])


def closed(walls: Array) -> tuple[MappedScans, list]:
    """Drive once round; in the end the world is another one."""
    mapped, closer, random = MappedScans(CONFIG), LoopCloser(CONFIG), np.random.default_rng(0)
    poses = ring(1.03, step=0.7)
    for node, pose in enumerate(poses):
        seen = scan(pose, random, walls=walls if node == len(poses) - 1 else WALLS)
        taken = Scan.from_ranges(seen, ANGLES, LIDAR, min_range=0.05, max_range=8.0)
        mapped.add(taken, pose, node)
        if node:
            mapped.connect(node - 1, node, STEP)
            closer.steps.append(STEP)
        if node in (len(poses) // 2, len(poses) - 1):
            edges = closer.search(mapped.graph, mapped.scans, node)
    return mapped, edges


def test_what_fits_closes_a_loop_at_once() -> None:
    mapped, edges = closed(WALLS)
    assert edges
    for edge in edges:
        assert edge.loop
        truth = mapped.graph.pose(edge.first).inverse() @ mapped.graph.pose(edge.second)
        assert edge.pose == pytest.approx(truth, abs=0.02)


def test_what_does_not_fit_closes_none() -> None:
    assert closed(WALLS @ np.diag([0.8, 1.3, 0.8, 1.3]) + 0.3)[1] == []
