"""Frontiers as RViz shows them, in explore_lite's colours."""

from __future__ import annotations

import numpy as np

from twin.bridge.msgs import ColorRGBA, Marker, header, new
from twin.navigation.exploration.explorer import Explorer
from twin.nodes.navigation.mapping.graph_markers import BLUE, RED, Look, point_marker

_GREEN = ColorRGBA(r=0.0, g=1.0, b=0.0, a=1.0)


def frontier_markers(explorer: Explorer, frame: str, time_ns: int) -> list[Marker]:
    """Return frontiers as blue points, given up ones as red points, their targets as green spheres.

    The first marker deletes those of the time before.
    """
    at, frontiers = header(time_ns, frame), explorer.frontiers
    looks: list[Look] = [(Marker.POINTS, frontier.points, 0.1, BLUE) for frontier in frontiers]
    if frontiers:
        looks.append((Marker.SPHERE_LIST, np.array([each.target for each in frontiers]), 0.3, _GREEN))
    if explorer.given_up:
        looks.append((Marker.POINTS, np.array(explorer.given_up), 0.2, RED))
    first = new(Marker, header=at, ns="frontiers", action=Marker.DELETEALL)
    return [first, *(point_marker(at, "frontiers", number, look) for number, look in enumerate(looks, 1))]
