"""SLAM: a pose graph of scans, matched with those before and with places seen again, and their map."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twin.errors import MapError
from twin.geometry import Array, Pose2
from twin.navigation.mapping.config import SlamConfig
from twin.navigation.mapping.correlation import Window
from twin.navigation.mapping.loop_closing import LoopCloser, spread
from twin.navigation.mapping.matcher import Match, Reference, levels_for
from twin.navigation.mapping.pose_graph import Edge, PoseGraph
from twin.navigation.mapping.scan import Scan
from twin.navigation.mapping.scan_map import ScanMap
from twin.navigation.mapping.storage import SavedGraph, pack, unpack
from twin.navigation.mapping.uncertainty import compounded, inverted, odometry_covariance, turned
from twin.navigation.maps.occupancy_map import OccupancyMap

__all__ = ["GraphView", "Slam", "SlamConfig", "SlamUpdate"]

Mode = Literal["mapping", "localization"]

REJECTED = 25.0
"""A loop's edge that disagrees by more than this [sigma^2] after optimisation is taken out again."""
DISAGREEING = 1.0
"""Loops that disagree by less than this [sigma^2] wait for others before the graph is optimised."""
MOST_WAITING = 10
"""So many loops wait at most."""
DOUBTFUL = 0.6
"""Below this score a match is compared with others ..."""
SECTORS = 8
"""... in so many parts of a window that is twice as wide ..."""
LOST = 0.3
"""... and below this in all directions."""
ALONE = 0.4
"""If nothing fits near odometry's guess, a match in another direction counts from this score on."""
EXPANDED = np.diag([1.0, 1.0, 25.0])
"""By so much odometry's covariance is larger if it may have slipped: it is mostly turns that slip."""
SLIPPED = np.diag([1.0, 1.0, 1e4])
"""By so much it is larger if it certainly has."""

START_COVARIANCE = np.diag([1.0, 1.0, 0.3])
"""Of the pose at which a session is said to start: x, y [m^2], yaw [rad^2]."""
START_WINDOW = (2.0, 1.0)
"""How far from there the robot is looked for: x and y [m], yaw [rad]."""


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
        self.loops_closed = 0
        self._graph = PoseGraph()
        self._scans: list[Scan] = []
        self._stamps: list[int] = []
        self._odom: Pose2 | None = None
        self._start: Pose2 | None = None
        self._closer = LoopCloser(self.config)
        self._waiting = 0
        self._map = ScanMap(self.config.resolution, self.config.max_laser_range)

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
        config = self.config
        scan = Scan.from_ranges(
            ranges, angles, T_base_lidar, min_range=config.min_laser_range, max_range=config.max_laser_range
        )
        if self._odom is None:
            return self._begin(odom, scan, stamp_ns)
        step = self._odom.inverse() @ odom
        if self.mode == "localization":
            return self._localise(odom, scan, step)
        last = self._graph.pose(len(self._graph) - 1)
        guess = last @ step
        match = self._match(self._recent(guess), scan, guess, turned(odometry_covariance(step), last.yaw))
        if match is None:
            pose, relative = guess, odometry_covariance(step)
        else:
            pose, relative = match.pose, turned(match.covariance, -last.yaw)
        self.covariance = compounded(self.covariance, last, last.inverse() @ pose, relative)
        node = self._add(scan, pose, stamp_ns)
        self._connect(node - 1, node, relative)
        self._closer.steps.append(relative)
        closed = config.do_loop_closing and self._close_loops(node)
        return self._finish(odom, self._graph.pose(node), node, closed, match)

    def to_bytes(self) -> bytes:
        """Return the pose graph with its scans and the parameters."""
        return pack(
            SavedGraph(
                config=self.config,
                graph=self._graph,
                scans=self._scans,
                stamps_ns=self._stamps,
                steps=self._closer.steps,
                covariance=self.covariance,
            )
        )

    def save(self, path: str | Path) -> None:
        """Write the pose graph with its scans and the parameters to a file."""
        Path(path).write_bytes(self.to_bytes())

    @staticmethod
    def load(
        path: str | Path,
        *,
        mode: Mode = "mapping",
        start: Pose2 | None = None,
        config: SlamConfig | None = None,
    ) -> Slam:
        """Go on with a saved pose graph; see `from_bytes`.

        Raises:
            MapError: the file cannot be read, or is not a saved pose graph.
        """
        try:
            data = Path(path).read_bytes()
        except OSError as fault:
            raise MapError(
                f"{path}: {fault.strerror or fault}; valid is a file that SLAM has saved"
            ) from None
        return Slam.from_bytes(data, mode=mode, start=start, config=config, name=str(path))

    @staticmethod
    def from_bytes(
        data: bytes,
        *,
        mode: Mode = "mapping",
        start: Pose2 | None = None,
        config: SlamConfig | None = None,
        name: str = "pose graph",
    ) -> Slam:
        """Go on with a saved pose graph.

        Args:
            data: What `to_bytes` has returned.
            mode: "mapping" adds to the graph, "localization" leaves it as it is.
            start: About where the robot is in the map frame; None: where the first scan was taken.
            config: Other parameters than the saved ones.
            name: What an error calls the data.

        Raises:
            MapError: the data are not those of a saved pose graph.
        """
        saved = unpack(data, name)
        slam = Slam(config or saved.config)
        slam.mode = mode
        slam._graph, slam._scans, slam._stamps = saved.graph, saved.scans, saved.stamps_ns
        slam._closer.steps = saved.steps
        slam.loops_closed = sum(edge.loop for edge in saved.graph.edges)
        slam.start_at(start or saved.graph.pose(0))
        return slam

    def start_at(self, pose: Pose2) -> None:
        """Look for the robot near `pose` in the map frame with the next scan, as after `/initialpose`."""
        self._start, self._odom = pose, None

    def pose(self, odom: Pose2) -> Pose2:
        """Return where the base is believed to be in the map frame, between scans too."""
        return self.T_map_odom @ odom

    def map(self) -> OccupancyMap:
        """Return the occupancy map; only what is new or has moved is drawn."""
        self._map.update(self._scans, self._graph.poses)
        return self._map.occupancy()

    def optimise(self) -> None:
        """Move the nodes to where they explain all that was measured best; done by itself at each loop."""
        self._graph.optimise()
        self._closer.forget()
        self._waiting = 0

    def entropy(self) -> float:
        """Return the differential entropy of the latest pose [nats]: 0.5 ln det(2 pi e covariance).

        gmapping's `/entropy`, that of its particles' weights, tells the same: how sure the pose is.
        """
        spread = 2.0 * math.pi * math.e * (self.covariance + 1e-12 * np.eye(3))
        return 0.5 * float(np.linalg.slogdet(spread)[1])

    def graph(self) -> GraphView:
        """Return nodes and edges."""
        edges = self._graph.edges
        return GraphView(
            poses=self._graph.poses.copy(),
            edges=np.array([(edge.first, edge.second) for edge in edges], dtype=np.int64).reshape(-1, 2),
            loops=np.array([edge.loop for edge in edges], dtype=np.bool_),
        )

    def _has_moved(self, odom: Pose2) -> bool:
        assert self._odom is not None
        step = self._odom.inverse() @ odom
        return (
            math.hypot(step.x, step.y) >= self.config.minimum_travel_distance
            or abs(step.yaw) >= self.config.minimum_travel_heading
        )

    def _begin(self, odom: Pose2, scan: Scan, stamp_ns: int) -> SlamUpdate:
        """Take the first scan: of all, or of this session in a graph that was loaded."""
        if self._start is None:
            node = self._add(scan, self.T_map_odom @ odom, stamp_ns)
            return self._finish(odom, self._graph.pose(node), node, False, None)
        match = self._match(self._near(self._start), scan, self._start, START_COVARIANCE, START_WINDOW)
        pose = self._start if match is None else match.pose
        self.covariance = START_COVARIANCE if match is None else match.covariance
        node = self._near(pose, 1)[0]
        if self.mode == "mapping":
            nearest, node = node, self._add(scan, pose, stamp_ns)
            self._connect(nearest, node, turned(self.covariance, -self._graph.pose(nearest).yaw))
            self._closer.steps.append(START_COVARIANCE)
            self._closer.forget()
        return self._finish(odom, pose, node, False, match)

    def _localise(self, odom: Pose2, scan: Scan, step: Pose2) -> SlamUpdate:
        assert self._odom is not None
        last = self.pose(self._odom)
        prior = compounded(self.covariance, last, step, odometry_covariance(step))
        guess = last @ step
        spread = 3.0 * math.sqrt(float(np.linalg.eigvalsh(prior[:2, :2])[-1]))
        widest = 0.5 * self.config.loop_search_space_dimension
        half = max(min(spread, widest), 0.5 * self.config.correlation_search_space_dimension)
        match = self._match(
            self._near(guess), scan, guess, prior, (half, self.config.coarse_search_angle_offset)
        )
        pose = guess if match is None else match.pose
        self.covariance = prior if match is None else match.covariance
        return self._finish(odom, pose, self._near(pose, 1)[0], False, match)

    def _add(self, scan: Scan, pose: Pose2, stamp_ns: int) -> int:
        self._scans.append(scan)
        self._stamps.append(stamp_ns)
        return self._graph.add_node(pose)

    def _connect(self, first: int, second: int, covariance: Array) -> None:
        self._graph.add_edge(
            Edge(
                first=first,
                second=second,
                pose=self._graph.pose(first).inverse() @ self._graph.pose(second),
                information=inverted(covariance),
                loop=False,
            )
        )

    def _finish(self, odom: Pose2, pose: Pose2, node: int, closed: bool, match: Match | None) -> SlamUpdate:
        self._odom = odom
        self.T_map_odom = pose @ odom.inverse()
        return SlamUpdate(
            pose=pose,
            covariance=self.covariance,
            T_map_odom=self.T_map_odom,
            loop_closed=closed,
            node=node,
            response=0.0 if match is None else match.inliers,
        )

    def _recent(self, guess: Pose2) -> list[int]:
        """Return the nodes just before, spread over the path."""
        config = self.config
        nodes = spread(self._graph.poses, range(len(self._graph) - 1, -1, -1), config.scan_buffer_size)
        away = np.hypot(*(self._graph.poses[nodes, :2] - guess[:2]).T)
        near = zip(nodes, (away < config.scan_buffer_maximum_scan_distance).tolist(), strict=True)
        return [node for node, is_near in near if is_near]

    def _near(self, guess: Pose2, most: int | None = None) -> list[int]:
        """Return the nodes that most likely have seen what is seen at `guess`: near, looking the same way."""
        offsets = self._graph.poses - guess
        away = np.hypot(offsets[:, 0], offsets[:, 1]) + 1.0 - np.cos(offsets[:, 2])
        return np.argsort(away, kind="stable")[: most or self.config.scan_buffer_size].tolist()

    def _match(
        self,
        nodes: Sequence[int],
        scan: Scan,
        guess: Pose2,
        prior: Array,
        halves: tuple[float, float] | None = None,
    ) -> Match | None:
        """Match with the scans of some nodes, in a window of half widths [m, rad]; None: odometry's."""
        config = self.config
        half = 0.5 * config.correlation_search_space_dimension
        width, angle = halves or (half, config.coarse_search_angle_offset)
        if not nodes:
            return None
        reference = Reference.of(
            [self._scans[node] for node in nodes],
            self._graph.poses[list(nodes)],
            resolution=config.correlation_search_space_resolution,
            deviation=config.correlation_search_space_smear_deviation,
            levels=levels_for(width, config.correlation_search_space_resolution),
        )
        window = Window(
            half_width=width,
            half_angle=angle,
            distance_variance=config.distance_variance_penalty,
            angle_variance=config.angle_variance_penalty,
            minimum_distance_penalty=config.minimum_distance_penalty,
            minimum_angle_penalty=config.minimum_angle_penalty,
        )
        least = config.link_match_minimum_response_fine
        if reference is None:
            return None
        match = reference.match(scan, guess, window, prior, least)
        if match is not None and match.score >= DOUBTFUL:
            return match
        # What responds most on the smeared grid need not fit best: ask for several.
        wide = replace(window, half_angle=2.0 * angle)
        match = _better(match, reference.best_match(scan, guess, wide, EXPANDED * prior, least, SECTORS))
        if match is not None and match.score >= LOST:
            return match
        # Odometry has slipped, or what is seen is new. Corridors look alike both ways: be sure.
        wide = replace(window, half_angle=math.pi)
        other = reference.best_match(scan, guess, wide, SLIPPED * prior, least, 4 * SECTORS)
        enough = ALONE if match is None else DOUBTFUL
        return other if other is not None and other.score >= enough else match

    def _close_loops(self, node: int) -> bool:
        edges = self._closer.search(self._graph, self._scans, node)
        if not edges:
            return False
        for edge in edges:
            self._graph.add_edge(edge)
        self._waiting += len(edges)
        worst = max(self._graph.squared_error(edge) for edge in edges)
        if worst < DISAGREEING and self._waiting < MOST_WAITING:
            return False
        before = self._graph.poses.copy()
        self._graph.optimise(5, math.inf)
        self._graph.optimise()
        self._waiting = 0
        wrong = [edge for edge in edges if self._graph.squared_error(edge) > REJECTED]
        if wrong:
            self._graph.poses[:] = before
            self._graph.edges = [edge for edge in self._graph.edges if edge not in wrong]
            if len(wrong) == len(edges):
                return False
            self._graph.optimise()
        self._closer.forget()
        self.loops_closed += len(edges) - len(wrong)
        self.covariance = self._graph.marginals().of(node)
        return True


def _better(first: Match | None, second: Match | None) -> Match | None:
    if first is None or second is None:
        return first or second
    return second if second.score > first.score + 0.02 else first
