"""A pose graph as RViz shows it: nodes as spheres, edges as lines, loops in another colour."""

from __future__ import annotations

import numpy as np

from twin.bridge.msgs import ColorRGBA, Header, Marker, Point, Pose, Vector3, header, new
from twin.geometry import Array
from twin.navigation.mapping.slam import GraphView

RED = ColorRGBA(r=1.0, g=0.0, b=0.0, a=1.0)
BLUE = ColorRGBA(r=0.0, g=0.0, b=1.0, a=1.0)
_GREEN = ColorRGBA(r=0.0, g=0.8, b=0.2, a=1.0)

Look = tuple[int, Array, float, ColorRGBA]
"""A marker's type, its points, shape (n, 2) [m], their size [m], their colour."""


def point_marker(at: Header, space: str, number: int, look: Look) -> Marker:
    """Return the marker of a namespace and a number that shows points on the floor."""
    kind, points, scale, colour = look
    return new(
        Marker,
        header=at,
        ns=space,
        id=number,
        type=kind,
        action=Marker.ADD,
        pose=new(Pose),
        scale=Vector3(x=scale, y=scale, z=scale),
        color=colour,
        points=[Point(x=x, y=y, z=0.0) for x, y in points.tolist()],
    )


def graph_markers(graph: GraphView, frame: str, time_ns: int) -> list[Marker]:
    """Return three markers: nodes, edges between successive scans, edges that close loops."""
    ends, at = graph.poses[graph.edges, :2].reshape(-1, 2), header(time_ns, frame)
    loop = np.repeat(graph.loops, 2)
    looks: list[Look] = [
        (Marker.SPHERE_LIST, graph.poses[:, :2], 0.1, RED),
        (Marker.LINE_LIST, ends[~loop], 0.03, BLUE),
        (Marker.LINE_LIST, ends[loop], 0.03, _GREEN),
    ]
    return [point_marker(at, "slam_toolbox", number, look) for number, look in enumerate(looks)]
