"""SLAM: a pose graph of scans, matched with those before and with places seen again, and their map."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twin.errors import MapError
from twin.files.reading import read_bytes
from twin.files.writing import replaced
from twin.geometry import Array, Pose2
from twin.navigation.mapping.config import Mode
from twin.navigation.mapping.config import SlamConfig as SlamConfig
from twin.navigation.mapping.loop_acceptance import LoopAcceptance
from twin.navigation.mapping.loop_closing import LoopCloser
from twin.navigation.mapping.mapped_scans import MappedScans, SavedGraph, pack, unpack
from twin.navigation.mapping.matcher import Match
from twin.navigation.mapping.registration import (
    START_COVARIANCE,
    Registration,
    at_start,
    doubted,
    while_driving,
)
from twin.navigation.mapping.scan import Scan
from twin.navigation.mapping.scan_map import ScanMap
from twin.navigation.mapping.uncertainty import compounded, odometry_covariance, turned
from twin.navigation.maps.occupancy_map import OccupancyMap


@dataclass(frozen=True, kw_only=True)
class SlamUpdate:
    """Where the robot is, after a scan was taken."""

    pose: Pose2
    """Of the base in the map frame."""
    covariance: Array
    """Of x, y, yaw in the map frame, shape (3, 3)."""
    T_map_odom: Pose2
    """What to publish as the transform map -> odom."""
    loop_closed: bool
    """Whether the whole graph has moved."""
    node: int
    """Of the scan in the graph; in localization mode the nearest node of the graph."""
    response: float
    """Part of the scan's points that lie on what was seen before, 0..1; 0 if only odometry was believed."""


class GraphView(NamedTuple):
    """The graph, to be shown."""

    poses: Array
    """Of the nodes in the map frame: x [m], y [m], yaw [rad], shape (n, 3)."""
    edges: NDArray[np.int64]
    """Pairs of nodes, shape (m, 2)."""
    loops: NDArray[np.bool_]
    """Which edges close loops, shape (m,)."""


class Slam:
    """Maps while it localises. Same inputs, same result: nothing is random.

    The structure is Karto's: Konolige et al., Efficient sparse pose adjustment for 2D mapping, IROS 2010.
    """

    def __init__(self, config: SlamConfig | None = None) -> None:
        self.config = config or SlamConfig()
        self.mode: Mode = "mapping"
        self.T_map_odom = Pose2(0.0, 0.0, 0.0)
        self.covariance: Array = np.zeros((3, 3))
        """Of x, y, yaw of the latest pose in the map frame, shape (3, 3)."""
        self._mapped = MappedScans(self.config)
        self._odom: Pose2 | None = None
        self._start: Pose2 | None = None
        self._tracked = (Pose2(0.0, 0.0, 0.0), Pose2(0.0, 0.0, 0.0))
        self._registration: Registration | None = None
        self._closer = LoopCloser(self.config)
        self._loops = LoopAcceptance()
        self._map = ScanMap(self.config.resolution, self.config.max_laser_range)

    @property
    def empty(self) -> bool:
        """Whether there is no node: nothing to draw a map of, or to save."""
        return not self._mapped.scans

    @property
    def loops_closed(self) -> int:
        """How many edges say that a place was seen again."""
        return self._loops.accepted

    def process(
        self, odom: Pose2, ranges: ArrayLike, angles: ArrayLike, T_base_lidar: Pose2, stamp_ns: int
    ) -> SlamUpdate | None:
        """Take a scan.

        Args:
            odom: The base in the odom frame when the scan was taken.
            ranges: Readings [m], shape (n,); inf saw nothing (and clears the map), NaN is not known.
            angles: Their bearings in the lidar's frame [rad], shape (n,), in order.
            T_base_lidar: The lidar in the base frame.
            stamp_ns: When the scan was taken.

        Returns:
            None if the robot has hardly moved since the last scan that was taken.
        """
        if self._odom is not None and not self._has_moved(odom):
            return None
        scan = self._scan(ranges, angles, T_base_lidar)
        if self._odom is None:
            return self._begin(odom, scan, stamp_ns)
        step = self._odom.inverse() @ odom
        if self.mode == "localization":
            return self._localise(odom, scan, step)
        return self._take(odom, scan, step, stamp_ns)

    def locate(
        self, odom: Pose2, ranges: ArrayLike, angles: ArrayLike, T_base_lidar: Pose2
    ) -> tuple[int, Pose2]:
        """Return where a scan was taken that `process` did not take, for it was too near to the last one.

        Odometry alone is off by some centimetres at most there; this is for those who want it exactly. See
        `process` for the arguments.

        Returns:
            The last node, and the pose of the base in its frame, which stays right when the graph moves.

        Raises:
            MapError: no scan was taken yet, or the graph is not to grow.
        """
        if self._odom is None or self.mode != "mapping":
            raise MapError("locate: there is no scan near by; valid is a call while mapping, after a scan")
        node = len(self._mapped.graph) - 1
        last, guess = self._mapped.graph.pose(node), self._guess(odom)
        if self._registration is None:
            self._registration = self._mapped.registration(self._mapped.recent(guess))
        step = self._tracked[0].inverse() @ odom
        scan = self._scan(ranges, angles, T_base_lidar)
        match = self._registration.match(scan, guess, turned(odometry_covariance(step), guess.yaw))
        pose = guess if match is None else match.pose
        self._tracked = (odom, last.inverse() @ pose)
        self.T_map_odom = pose @ odom.inverse()
        return node, self._tracked[1]

    def to_bytes(self) -> bytes:
        """Return the pose graph with its scans and the parameters."""
        return pack(SavedGraph(self._mapped, self._closer.steps, self.covariance))

    def save(self, path: str | Path) -> None:
        """Write the pose graph with its scans and the parameters to a file.

        Raises:
            MapError: there is no scan yet, and a file without any cannot be gone on with.
            OSError: the file cannot be written.
        """
        if self.empty:
            raise MapError(f"{path}: there is no scan to save yet; valid is a call after the first one")
        with replaced(Path(path)) as new:
            new.write_bytes(self.to_bytes())

    @staticmethod
    def load(
        path: str | Path,
        *,
        mode: Mode = "mapping",
        start: Pose2 | None = None,
        config: SlamConfig | None = None,
    ) -> Slam:
        """Go on with a saved pose graph.

        Args:
            path: What `save` has written.
            mode: "mapping" adds to the graph, "localization" leaves it as it is.
            start: About where the robot is in the map frame; None: where the first scan was taken.
            config: Other parameters than the saved ones.

        Raises:
            MapError: the file cannot be read, or is not a saved pose graph.
        """
        try:
            saved = unpack(read_bytes(Path(path)), str(path))
        except OSError as fault:
            reason = fault.strerror or fault
            raise MapError(f"{path}: {reason}; valid is a file that SLAM has saved") from None
        slam, graph = Slam(config or saved.mapped.config), saved.mapped.graph
        slam.mode = mode
        slam._mapped, slam._mapped.config = saved.mapped, slam.config
        slam._closer.steps = saved.steps
        slam._loops.accepted = sum(edge.loop for edge in graph.edges)
        slam.start_at(start or graph.pose(0))
        return slam

    def start_at(self, pose: Pose2) -> None:
        """Look for the robot near `pose` in the map frame with the next scan, as after `/initialpose`."""
        self._start, self._odom = pose, None

    def pose(self, odom: Pose2) -> Pose2:
        """Return where the base is believed to be in the map frame, between scans too."""
        return self.T_map_odom @ odom

    def map(self) -> OccupancyMap:
        """Return the occupancy map; only what is new or has moved is drawn."""
        self._map.update(self._mapped.scans, self._mapped.graph.poses)
        return self._map.occupancy()

    def optimise(self) -> None:
        """Move the nodes to where they explain all that was measured best; done by itself at each loop."""
        self._mapped.graph.optimise()
        self._loops.forget()
        self._moved()

    def entropy(self) -> float:
        """Return the differential entropy of the latest pose [nats]: 0.5 ln det(2 pi e covariance).

        gmapping's `/entropy` is that of its particles' weights, which there are none of here; it, too, falls
        when a loop closes. It is of the pose, not of the map.
        """
        spread = 2.0 * math.pi * math.e * (self.covariance + 1e-12 * np.eye(3))
        return 0.5 * float(np.linalg.slogdet(spread)[1])

    def graph(self) -> GraphView:
        """Return nodes and edges."""
        graph = self._mapped.graph
        first, second, *_, loops = graph.arrays()
        return GraphView(poses=graph.poses.copy(), edges=np.column_stack([first, second]), loops=loops)

    def _has_moved(self, odom: Pose2) -> bool:
        assert self._odom is not None
        step = self._odom.inverse() @ odom
        driven = math.hypot(step.x, step.y) >= self.config.minimum_travel_distance
        return driven or abs(step.yaw) >= self.config.minimum_travel_heading

    def _scan(self, ranges: ArrayLike, angles: ArrayLike, T_base_lidar: Pose2) -> Scan:
        low, high = self.config.min_laser_range, self.config.max_laser_range
        return Scan.from_ranges(ranges, angles, T_base_lidar, min_range=low, max_range=high)

    def _guess(self, odom: Pose2) -> Pose2:
        """Return where odometry leads from the last node, or from where a scan was located since then."""
        before, relative = self._tracked
        last = self._mapped.graph.pose(len(self._mapped.graph) - 1)
        return last @ relative @ (before.inverse() @ odom)

    def _begin(self, odom: Pose2, scan: Scan, stamp_ns: int) -> SlamUpdate:
        """Take the first scan: of all, or of this session in a graph that was loaded."""
        mapped = self._mapped
        if self._start is None:
            node = mapped.add(scan, self.T_map_odom @ odom, stamp_ns)
            return self._finish(odom, mapped.graph.pose(node), node, False, None)
        pose, self.covariance, match = at_start(mapped, scan, self._start)
        node = mapped.near(pose, 1)[0]
        if self.mode == "mapping":
            nearest, node = node, mapped.add(scan, pose, stamp_ns)
            mapped.connect(nearest, node, turned(self.covariance, -mapped.graph.pose(nearest).yaw))
            self._closer.steps.append(START_COVARIANCE)
            self._closer.forget()
        return self._finish(odom, pose, node, False, match)

    def _take(self, odom: Pose2, scan: Scan, step: Pose2, stamp_ns: int) -> SlamUpdate:
        """Add a scan to the map."""
        mapped, graph = self._mapped, self._mapped.graph
        last, guess = graph.pose(len(graph) - 1), self._guess(odom)
        prior = turned(odometry_covariance(step), last.yaw)
        match = mapped.registration(mapped.recent(guess)).match(scan, guess, prior)
        pose = guess if match is None else match.pose
        relative = turned(prior if match is None else doubted(match, guess, prior), -last.yaw)
        self.covariance = compounded(self.covariance, last, last.inverse() @ pose, relative)
        node = mapped.add(scan, pose, stamp_ns)
        mapped.connect(node - 1, node, relative)
        self._closer.steps.append(relative)
        closed = self.config.do_loop_closing and self._loops.add(
            graph, self._closer.search(graph, mapped.scans, node)
        )
        if closed:
            self._closer.forget()
            self.covariance = graph.marginals().of(node)
        return self._finish(odom, graph.pose(node), node, closed, match)

    def _localise(self, odom: Pose2, scan: Scan, step: Pose2) -> SlamUpdate:
        assert self._odom is not None
        last = self.pose(self._odom)
        prior = compounded(self.covariance, last, step, odometry_covariance(step))
        pose, self.covariance, match = while_driving(self._mapped, scan, last @ step, prior)
        return self._finish(odom, pose, self._mapped.near(pose, 1)[0], False, match)

    def _moved(self) -> None:
        """The nodes have moved: so has the robot with the last of them."""
        self._registration = None
        self._closer.forget()
        if self._odom is not None and self.mode == "mapping":
            self.T_map_odom = self._guess(self._tracked[0]) @ self._tracked[0].inverse()

    def _finish(self, odom: Pose2, pose: Pose2, node: int, closed: bool, match: Match | None) -> SlamUpdate:
        self._odom = odom
        self._tracked = (odom, Pose2(0.0, 0.0, 0.0))
        self._registration = None
        self.T_map_odom = pose @ odom.inverse()
        return SlamUpdate(
            pose=pose,
            covariance=self.covariance,
            T_map_odom=self.T_map_odom,
            loop_closed=closed,
            node=node,
            response=0.0 if match is None else match.inliers,
        )
