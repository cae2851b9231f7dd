"""Frontiers as RViz shows them, in explore_lite's colours."""

from __future__ import annotations

from twin.bridge.msgs import ColorRGBA, Marker, Point, Pose, Vector3, header, new
from twin.geometry import Array
from twin.navigation.exploration.explorer import Explorer

_BLUE = ColorRGBA(r=0.0, g=0.0, b=1.0, a=1.0)
_RED = ColorRGBA(r=1.0, g=0.0, b=0.0, a=1.0)
_GREEN = ColorRGBA(r=0.0, g=1.0, b=0.0, a=1.0)


def frontier_markers(explorer: Explorer, frame: str, time_ns: int) -> list[Marker]:
    """Return frontiers as blue points, given up ones as red points, their targets as green spheres.

    The first marker deletes those of the time before.
    """
    shared = header(time_ns, frame)
    markers = [new(Marker, header=shared, ns="frontiers", action=Marker.DELETEALL)]

    def add(kind: int, points: Array | list[tuple[float, float]], scale: float, colour: ColorRGBA) -> None:
        markers.append(
            new(
                Marker,
                header=shared,
                ns="frontiers",
                id=len(markers),
                type=kind,
                action=Marker.ADD,
                pose=new(Pose),
                scale=Vector3(x=scale, y=scale, z=scale),
                color=colour,
                points=[Point(x=float(x), y=float(y), z=0.0) for x, y in points],
            )
        )

    for frontier in explorer.frontiers:
        add(Marker.POINTS, frontier.points, 0.1, _BLUE)
    if explorer.frontiers:
        add(Marker.SPHERE_LIST, [frontier.target for frontier in explorer.frontiers], 0.3, _GREEN)
    if explorer.given_up:
        add(Marker.POINTS, explorer.given_up, 0.2, _RED)
    return markers
