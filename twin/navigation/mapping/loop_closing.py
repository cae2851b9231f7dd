"""Finding places that are seen again, and telling them from places that only look alike."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import compress
from typing import NamedTuple

import numpy as np

from twin.geometry import Array, Pose2
from twin.navigation.mapping.config import SlamConfig
from twin.navigation.mapping.correlation import Window
from twin.navigation.mapping.matcher import Match, Reference, levels_for
from twin.navigation.mapping.pose_graph import Edge, Marginals, PoseGraph
from twin.navigation.mapping.scan import Scan
from twin.navigation.mapping.uncertainty import compounded, difference, inverted, turned

MOST_PLACES = 3
"""So many places are tried for a scan."""
SURE = 0.25
"""Below this standard deviation [m] one match is enough; above, matches must agree."""
UNSURE_SCORE = 0.45
"""Such a match must have this score ..."""
DISTINCT = 0.15
"""... and one that is by this better than in any other place in the window ..."""
WEAK_INLIERS, WEAK_SCORE, WEAK_DISTINCT = 0.4, 0.3, 0.05
"""... or at least these, and more matches must agree."""
AGREEING = 3
"""So many matches must agree ..."""
AGREEING_FAR = 5
"""... and so many weak ones, or if they say that the path has drifted by more than its covariance tells."""
FAR = 3.0
"""A place that is not where it is expected is looked for again in a window larger by this factor ..."""
FARTHER = (1.0, 0.1)
"""... and so much: x and y [m], yaw [rad]. Steady drift is more than the covariance of its steps tells ..."""
FARTHEST = 5.0
"""... but no farther away than this [m]."""
FAR_RESPONSE = 0.5
"""The correlative match there must be as good as this."""
REMEMBERED = 12
"""A match waits for others to agree for so many scans."""
GATE = 20.0
"""Squared difference [sigma^2] of three values that is still believed (once in 6000 it is exceeded)."""
REFRESH = 10
"""Covariances are computed anew after so many scans."""
SPREAD = 0.2
"""Scans that are apart by less than this [m, rad] see the same."""


class _Candidate(NamedTuple):
    edge: Edge
    needed: int
    """So many must agree."""


class LoopCloser:
    """Proposes edges between a new node and places seen before."""

    def __init__(self, config: SlamConfig) -> None:
        self.config = config
        self.steps: list[Array] = [np.zeros((3, 3))]
        """Covariance of each node in the frame of the one before, shape (3, 3)."""
        self._marginals: Marginals | None = None
        self._searched = 0
        self._waiting: list[_Candidate] = []

    def forget(self) -> None:
        """The poses have moved: covariances are computed anew."""
        self._marginals = None

    def search(self, graph: PoseGraph, scans: Sequence[Scan], node: int) -> list[Edge]:
        """Return the edges that close loops at `node`, which is the last one; often none."""
        if not apart(graph.poses[node], graph.poses[self._searched]):
            return []
        self._searched = node
        self._waiting = [waiting for waiting in self._waiting if waiting.edge.second > node - REMEMBERED]
        found = []
        for place in self._places(graph, node):
            candidate = self._try(graph, scans, node, place)
            if candidate is None:
                continue
            if candidate.needed == 1:
                found.append(candidate.edge)
            else:
                self._waiting.append(candidate)
        return found or self._agreed(graph)

    def _places(self, graph: PoseGraph, node: int) -> list[int]:
        """Return the nearest node of each stretch of the path that passes near, nearest first."""
        config = self.config
        old = spread(graph.poses, range(node, -1, -1), config.scan_buffer_size)[-1]
        if old < config.loop_match_minimum_chain_size:
            return []
        distances = np.hypot(*(graph.poses[:old, :2] - graph.poses[node, :2]).T)
        widest = config.loop_search_maximum_distance + 0.5 * config.loop_search_space_dimension
        near = np.flatnonzero(distances < widest)
        places = []
        for chain in np.split(near, np.flatnonzero(np.diff(near) > 1) + 1):
            if len(chain) < config.loop_match_minimum_chain_size:
                continue
            nearest = int(chain[np.argmin(distances[chain])])
            position, _ = self._spread(graph, nearest, node)
            if distances[nearest] < config.loop_search_maximum_distance + 2.0 * position:
                places.append(nearest)
        return sorted(places, key=lambda place: float(distances[place]))[:MOST_PLACES]

    def _spread(self, graph: PoseGraph, first: int, second: int) -> tuple[float, float]:
        covariance = self.covariance(graph, first, second)
        position = math.sqrt(max(float(np.linalg.eigvalsh(covariance[:2, :2])[-1]), 0.0))
        return position, math.sqrt(max(float(covariance[2, 2]), 0.0))

    def covariance(self, graph: PoseGraph, first: int, second: int) -> Array:
        """Return the covariance, shape (3, 3), of the pose of `second` in the frame of `first`."""
        if self._marginals is None or len(self._marginals) < second + 1 - REFRESH:
            self._marginals = graph.marginals()
        known = len(self._marginals) - 1
        if first <= known:
            base, start = self._marginals.between(first, min(known, second)), known
        else:
            base, start = np.zeros((3, 3)), first
        origin = graph.pose(first).inverse()
        for node in range(start + 1, second + 1):
            before, step = graph.pose(node - 1), graph.pose(node - 1).inverse() @ graph.pose(node)
            base = compounded(base, origin @ before, step, self.steps[node])
        return base

    def _try(self, graph: PoseGraph, scans: Sequence[Scan], node: int, place: int) -> _Candidate | None:
        """Return the edge that matching finds where it is expected, else in a larger window."""
        position, heading = self._spread(graph, place, node)
        covariance = self.covariance(graph, place, node)
        prior = turned(covariance, graph.pose(place).yaw) + np.diag([1e-4, 1e-4, 1e-5])
        near = Window(half_width=3.0 * position + 0.2, half_angle=3.0 * heading + 0.05)
        least = self.config.loop_match_minimum_response_coarse
        expected = self._match(graph, scans, node, place, near, prior, least, position < SURE)
        if expected is not None:
            match, needed = expected
            moved = difference(graph.pose(node), match.pose)
            if moved @ np.linalg.solve(prior + match.covariance, moved) <= GATE:
                return _Candidate(_edge(place, node, graph.pose(place), match), needed)
        half = min(FAR * near.half_width + FARTHER[0], FARTHEST)
        if half <= near.half_width:
            return None
        far = Window(half_width=half, half_angle=near.half_angle + FARTHER[1])
        elsewhere = self._match(graph, scans, node, place, far, FAR**2 * prior, FAR_RESPONSE, False)
        if elsewhere is None:
            return None
        return _Candidate(_edge(place, node, graph.pose(place), elsewhere[0]), AGREEING_FAR)

    def _match(
        self,
        graph: PoseGraph,
        scans: Sequence[Scan],
        node: int,
        place: int,
        window: Window,
        prior: Array,
        least: float,
        sure: bool,
    ) -> tuple[Match, int] | None:
        """Return where a node's scan fits at a place, and how many must agree: one if `sure` of the place."""
        config = self.config
        half = min(window.half_width, 0.5 * config.loop_search_space_dimension)
        window = replace(window, half_width=half, half_angle=min(window.half_angle, math.pi))
        members = self._members(graph, place, node)
        reference = Reference.of(
            [scans[member] for member in members],
            graph.poses[members],
            resolution=config.loop_search_space_resolution,
            deviation=config.loop_search_space_smear_deviation,
            levels=levels_for(half, config.loop_search_space_resolution),
        )
        if reference is None:
            return None
        guess = graph.pose(node)
        # Where the place is was not measured by odometry here: a weak prior, that only holds along corridors.
        match = reference.match(scans[node], guess, window, 9.0 * prior, least)
        if match is None:
            return None
        fits = match.inliers >= config.loop_match_minimum_response_fine
        if sure:
            return (match, 1) if fits else None
        if match.inliers < WEAK_INLIERS or match.score < WEAK_SCORE:
            return None
        rival = reference.rival(scans[node], match, guess, window, 9.0 * prior)
        margin = 1.0 if rival is None else match.score - rival.score
        if margin < WEAK_DISTINCT:
            return None
        strong = fits and match.score >= UNSURE_SCORE and margin >= DISTINCT
        return match, AGREEING if strong else AGREEING_FAR

    def _members(self, graph: PoseGraph, place: int, node: int) -> list[int]:
        """Return nodes before and after a place, spread over the path, without those just before `node`."""
        config = self.config
        half = config.scan_buffer_size // 4 + 1
        last = spread(graph.poses, range(node, -1, -1), config.scan_buffer_size)[-1]
        before = spread(graph.poses, range(place, -1, -1), half)
        after = spread(graph.poses, range(place, max(last, place + 1)), half)
        members = [*before[::-1], *after[1:]]
        away = np.hypot(*(graph.poses[members, :2] - graph.poses[place, :2]).T)
        return list(compress(members, away < config.scan_buffer_maximum_scan_distance))

    def _agreed(self, graph: PoseGraph) -> list[Edge]:
        """Return waiting edges that agree with the latest one about how far the path has drifted."""
        if not self._waiting:
            return []
        latest = self._waiting[-1]
        agreeing = [other for other in self._waiting if self._agree(graph, latest.edge, other.edge)]
        if len({other.edge.second for other in agreeing}) < latest.needed:
            return []
        self._waiting = [waiting for waiting in self._waiting if waiting not in agreeing]
        return [other.edge for other in agreeing]

    def _agree(self, graph: PoseGraph, latest: Edge, other: Edge) -> bool:
        if latest is other:
            return True
        # Round the loop: along the new path, across, along the old path, and back must lead to the start.
        new = graph.pose(other.second).inverse() @ graph.pose(latest.second)
        old = graph.pose(other.first).inverse() @ graph.pose(latest.first)
        around = (old @ latest.pose).inverse() @ (other.pose @ new)
        span = abs(new.x) + abs(new.y) + abs(old.x) + abs(old.y)
        return math.hypot(around.x, around.y) < 0.15 + 0.02 * span and abs(around.yaw) < 0.06


def spread(poses: Array, nodes: Iterable[int], most: int) -> list[int]:
    """Return up to `most` of `nodes`, the first and those that have moved from the one chosen before.

    Args:
        poses: Of all nodes, shape (n, 3).
        nodes: In their order along the path, or against it.
        most: At most so many.
    """
    chosen: list[int] = []
    for node in nodes:
        if not chosen or apart(poses[node], poses[chosen[-1]]):
            chosen.append(node)
            if len(chosen) == most:
                break
    return chosen


def apart(first: Array, second: Array) -> bool:
    """Return whether two poses, shape (3,), differ enough to see something else."""
    turn = math.remainder(first[2] - second[2], 2.0 * math.pi)
    return math.hypot(first[0] - second[0], first[1] - second[1]) > SPREAD or abs(turn) > SPREAD


def _edge(place: int, node: int, here: Pose2, match: Match) -> Edge:
    information = inverted(turned(match.covariance, -here.yaw))
    return Edge(
        first=place, second=node, pose=here.inverse() @ match.pose, information=information, loop=True
    )
