"""The ways that MPPI chose from, as nav2_mppi_controller's TrajectoryVisualizer shows them in RViz."""

from __future__ import annotations

from twin.bridge.msgs import ColorRGBA, Marker, MarkerArray, Point, Pose, Vector3, header, new
from twin.geometry import Array

_HEIGHT = {"Candidate Trajectories": 0.03, "Optimal Trajectory": 0.06}
"""Above the floor [m]."""


def trajectory_markers(candidates: Array, optimal: Array | None, frame: str, time_ns: int) -> MarkerArray:
    """Return one marker of points for all candidates, and one for the optimal trajectory.

    Two markers of many points instead of Nav2's many spheres: a hundredth of the bytes. As there, points fade
    from the robot to the ends: candidates from blue to green, the optimal one from black to cyan.

    Args:
        candidates: Shape (n, m, 2) [m].
        optimal: Shape (k, 3), or None.
        frame: Of both.
        time_ns: Of both.
    """
    steps = candidates.shape[1]
    shades = [ColorRGBA(r=0.0, g=i / steps, b=1.0 - i / steps, a=1.0) for i in range(steps)]
    markers = [_points("Candidate Trajectories", candidates.reshape(-1, 2), shades, frame, time_ns)]
    if optimal is not None:
        count = len(optimal)
        shades = [ColorRGBA(r=0.0, g=i / count, b=i / count, a=1.0) for i in range(count)]
        markers.append(_points("Optimal Trajectory", optimal[:, :2], shades, frame, time_ns))
    return new(MarkerArray, markers=markers)


def _points(space: str, points: Array, shades: list[ColorRGBA], frame: str, time_ns: int) -> Marker:
    """Return points whose colours go through `shades` again and again."""
    height = _HEIGHT[space]
    return new(
        Marker,
        header=header(time_ns, frame),
        ns=space,
        type=Marker.POINTS,
        action=Marker.ADD,
        pose=new(Pose),
        scale=Vector3(x=0.03, y=0.03, z=0.0),
        points=[Point(x=float(x), y=float(y), z=height) for x, y in points],
        colors=shades * (len(points) // len(shades)),
    )
