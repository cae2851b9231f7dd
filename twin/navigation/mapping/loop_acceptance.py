"""Taking loops into a graph, and out again if it cannot be made to agree with them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from twin.navigation.mapping.pose_graph import Edge, PoseGraph

REJECTED = 25.0
"""A loop's edge that disagrees by more than this [sigma^2] after optimisation is taken out again."""
DISAGREEING = 1.0
"""Loops that disagree by less than this [sigma^2] wait for others before the graph is optimised."""
MOST_WAITING = 10
"""So many loops wait at most."""


class LoopAcceptance:
    """Adds loops' edges to a graph and optimises it when they say something new."""

    def __init__(self) -> None:
        self.accepted = 0
        """So many edges were, since the graph was begun."""
        self._waiting = 0

    def forget(self) -> None:
        """The graph was optimised: no edge waits."""
        self._waiting = 0

    def add(self, graph: PoseGraph, edges: Sequence[Edge]) -> bool:
        """Add edges, none or some; return whether the whole graph has moved."""
        if not edges:
            return False
        graph.edges += edges
        self._waiting += len(edges)
        self.accepted += len(edges)
        worst = max(graph.squared_error(edge) for edge in edges)
        if worst < DISAGREEING and self._waiting < MOST_WAITING:
            return False
        before = graph.poses.copy()
        graph.optimise(5, math.inf)
        graph.optimise()
        self._waiting = 0
        wrong = [edge for edge in edges if graph.squared_error(edge) > REJECTED]
        self.accepted -= len(wrong)
        if wrong:
            graph.poses[:] = before
            graph.edges = [edge for edge in graph.edges if edge not in wrong]
            if len(wrong) == len(edges):
                return False
            graph.optimise()
        return True
