"""The scans of a map with the graph of their poses, and which of them a new scan is matched with."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import compress

import numpy as np

from twin.geometry import Array, Pose2
from twin.navigation.mapping.config import SlamConfig
from twin.navigation.mapping.loop_closing import spread
from twin.navigation.mapping.pose_graph import Edge, PoseGraph
from twin.navigation.mapping.registration import Registration
from twin.navigation.mapping.scan import Scan
from twin.navigation.mapping.uncertainty import inverted


class MappedScans:
    """Node `i` of `graph` is where scan `i` was taken."""

    def __init__(
        self,
        config: SlamConfig,
        graph: PoseGraph | None = None,
        scans: list[Scan] | None = None,
        stamps_ns: list[int] | None = None,
    ) -> None:
        """Begin with what a saved graph holds; by default with nothing."""
        self.config = config
        self.graph = graph or PoseGraph()
        self.scans = scans or []
        self.stamps_ns = stamps_ns or []

    def add(self, scan: Scan, pose: Pose2, stamp_ns: int) -> int:
        """Return the node of a new scan."""
        self.scans.append(scan)
        self.stamps_ns.append(stamp_ns)
        return self.graph.add_node(pose)

    def connect(self, first: int, second: int, covariance: Array) -> None:
        """Hold two nodes where they are now, with a covariance, shape (3, 3), in the frame of the first."""
        step = self.graph.pose(first).inverse() @ self.graph.pose(second)
        information = inverted(covariance)
        self.graph.edges.append(
            Edge(first=first, second=second, pose=step, information=information, loop=False)
        )

    def recent(self, guess: Pose2) -> list[int]:
        """Return the nodes just before, spread over the path: those near `guess`, or the last one alone.

        As in Karto, whose running scans never lose the last one: after a long way unseen it is what there is.
        """
        config = self.config
        nodes = spread(self.graph.poses, range(len(self.graph) - 1, -1, -1), config.scan_buffer_size)
        away = np.hypot(*(self.graph.poses[nodes, :2] - guess[:2]).T)
        return list(compress(nodes, away < config.scan_buffer_maximum_scan_distance)) or nodes[:1]

    def near(self, guess: Pose2, most: int | None = None) -> list[int]:
        """Return the nodes that most likely have seen what is seen at `guess`: near, looking the same way."""
        offsets = self.graph.poses - guess
        away = np.hypot(offsets[:, 0], offsets[:, 1]) + 1.0 - np.cos(offsets[:, 2])
        return np.argsort(away, kind="stable")[: most or self.config.scan_buffer_size].tolist()

    def registration(self, nodes: Sequence[int], half_width: float | None = None) -> Registration:
        """Return the scans of some nodes, ready to be matched with; see `Registration`."""
        poses = self.graph.poses[list(nodes)]
        return Registration(self.config, [self.scans[node] for node in nodes], poses, half_width)
