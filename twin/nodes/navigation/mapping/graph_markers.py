"""A pose graph as RViz shows it: nodes as spheres, edges as lines, loops in another colour."""

from __future__ import annotations

import numpy as np

from twin.bridge.msgs import ColorRGBA, Marker, Point, Pose, Vector3, header, new
from twin.navigation.mapping.slam import GraphView

_RED = ColorRGBA(r=1.0, g=0.0, b=0.0, a=1.0)
_BLUE = ColorRGBA(r=0.0, g=0.0, b=1.0, a=1.0)
_GREEN = ColorRGBA(r=0.0, g=0.8, b=0.2, a=1.0)


def graph_markers(graph: GraphView, frame: str, time_ns: int) -> list[Marker]:
    """Return three markers: nodes, edges between successive scans, edges that close loops."""
    ends = graph.poses[graph.edges, :2].reshape(-1, 2)
    loop = np.repeat(graph.loops, 2)
    parts = (
        (Marker.SPHERE_LIST, graph.poses[:, :2], 0.1, _RED),
        (Marker.LINE_LIST, ends[~loop], 0.03, _BLUE),
        (Marker.LINE_LIST, ends[loop], 0.03, _GREEN),
    )
    return [
        new(
            Marker,
            header=header(time_ns, frame),
            ns="slam_toolbox",
            id=number,
            type=kind,
            action=Marker.ADD,
            pose=new(Pose),
            scale=Vector3(x=scale, y=scale, z=scale),
            color=colour,
            points=[Point(x=x, y=y, z=0.0) for x, y in points.tolist()],
        )
        for number, (kind, points, scale, colour) in enumerate(parts)
    ]
