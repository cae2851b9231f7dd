"""The scans of a map with the graph of their poses, and which of them a new scan is matched with.

As bytes they are a compressed npz archive.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Sequence
from dataclasses import asdict
from itertools import compress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twin.errors import MapError
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


FORMAT = "twin pose graph 1"


class SavedGraph(NamedTuple):
    """What a file holds."""

    mapped: MappedScans
    steps: list[Array]
    """Covariance of each node in the frame of the one before, shape (3, 3)."""
    covariance: Array
    """Of the last node in the map frame, shape (3, 3)."""


def pack(saved: SavedGraph) -> bytes:
    """Return a graph as bytes; the same graph gives the same bytes."""
    mapped, scans = saved.mapped, saved.mapped.scans
    first, second, poses, information, loops = mapped.graph.arrays()
    arrays: dict[str, NDArray[np.generic]] = {
        "header": np.array(json.dumps({"format": FORMAT, "config": asdict(mapped.config)})),
        "poses": mapped.graph.poses,
        "stamps_ns": np.array(mapped.stamps_ns, dtype=np.int64),
        "steps": np.array(saved.steps).reshape(-1, 3, 3),
        "covariance": saved.covariance,
        "edge_nodes": np.column_stack([first, second]),
        "edge_poses": poses,
        "edge_information": information,
        "edge_loops": loops,
        "sensors": np.array([scan.sensor for scan in scans], np.float64).reshape(-1, 3),
        "beams": np.array([len(scan.ranges) for scan in scans], np.int64),
        "ranges": np.concatenate([np.zeros(0), *(scan.ranges for scan in scans)]),
        "angles": np.concatenate([np.zeros(0), *(scan.angles for scan in scans)]),
    }
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)  # type: ignore[arg-type]  # numpy's stub takes **kwds for its flag
    return buffer.getvalue()


def unpack(data: bytes, name: str) -> SavedGraph:
    """Return the graph that `pack` has made bytes of.

    Raises:
        MapError: these are not such bytes; it says so of `name`.
    """
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            arrays = {key: archive[key] for key in archive.files}
        header = json.loads(str(arrays["header"]))
        if header["format"] != FORMAT:
            raise ValueError(header["format"])
        return _unpacked(SlamConfig(**header["config"]), arrays)
    except (ValueError, KeyError, TypeError, IndexError, OSError, EOFError, zipfile.BadZipFile) as fault:
        raise MapError(f"{name}: is not a pose graph; valid is a file that SLAM has saved") from fault


def _unpacked(config: SlamConfig, arrays: dict[str, NDArray[np.generic]]) -> SavedGraph:
    graph = PoseGraph()
    for pose in _rows(arrays["poses"]):
        graph.add_node(pose)
    for (first, second), pose, information, loop in zip(
        np.asarray(arrays["edge_nodes"], np.int64).tolist(),
        _rows(arrays["edge_poses"]),
        np.asarray(arrays["edge_information"], np.float64),
        arrays["edge_loops"].tolist(),
        strict=True,
    ):
        if not (0 <= first < len(graph) and 0 <= second < len(graph)):
            raise ValueError(f"edge {first}-{second}")
        edge = Edge(first=first, second=second, pose=pose, information=information, loop=bool(loop))
        graph.edges.append(edge)
    ends = np.cumsum(np.asarray(arrays["beams"], np.int64))[:-1]
    ranges = np.split(np.asarray(arrays["ranges"], np.float64), ends)
    angles = np.split(np.asarray(arrays["angles"], np.float64), ends)
    sensors = _rows(arrays["sensors"])
    low, high = config.min_laser_range, config.max_laser_range
    scans = [
        Scan.from_ranges(*parts, min_range=low, max_range=high)
        for parts in zip(ranges, angles, sensors, strict=True)
    ]
    if len({len(scans), len(graph), len(arrays["stamps_ns"]), len(arrays["steps"])}) != 1 or not scans:
        raise ValueError("numbers of nodes differ")
    stamps_ns = np.asarray(arrays["stamps_ns"], np.int64).tolist()
    return SavedGraph(
        mapped=MappedScans(config, graph, scans, stamps_ns),
        steps=list(np.asarray(arrays["steps"], np.float64)),
        covariance=np.asarray(arrays["covariance"], np.float64).reshape(3, 3),
    )


def _rows(array: NDArray[np.generic]) -> Sequence[Pose2]:
    return [Pose2(x, y, yaw) for x, y, yaw in np.asarray(array, np.float64).tolist()]
