"""visualization_msgs: the markers of RViz."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from twin.bridge.conversions import pose3_from_pose
from twin.bridge.msgs import ns
from twin.geometry import Array, Pose3, xyzw_from_wxyz
from twin.recording.channels.channel import Channel, Context
from twin.recording.columns import TIMELINE

if TYPE_CHECKING:
    from twin.bridge.topics import Sample

_ADD, _DELETE_ALL = 0, 3
_ARROW, _CUBE, _SPHERE, _CYLINDER, _LINE_STRIP, _LINE_LIST, _CUBE_LIST, _SPHERE_LIST, _POINTS, _TEXT = range(
    10
)
_TRIANGLES = 11
_SHAFT = 0.5
"""Radius of an arrow of a marker, relative to scale.y, which is its diameter."""


class MarkerChannel(Channel[Any]):
    """Marker and MarkerArray, but for meshes from files; each goes when told to, or after its lifetime."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self._ends: dict[str, int | None] = {}
        """By entity: when it goes [ns], None: not by itself."""

    def take(self, sample: Sample[Any]) -> None:
        """Draw, change and delete."""
        self._delete_over(sample.time_ns)
        message = sample.message
        for marker in getattr(message, "markers", None) or [message]:
            if hasattr(marker, "action"):
                self._apply(marker, sample.time_ns)

    def chunks(self, rows: list[Any]) -> tuple[()]:
        """Yield nothing: there are no rows."""
        return ()

    def _apply(self, marker: Any, time_ns: int) -> None:
        entity = f"/ros{self.topic}/" + rr.new_entity_path([marker.ns or "_", str(marker.id)]).lstrip("/")
        if marker.action == _DELETE_ALL:
            for each in list(self._ends):
                self._delete(each, time_ns)
        elif marker.action != _ADD:
            self._delete(entity, time_ns)
        elif (shape := drawn(marker)) is not None:
            frame = self.context.frames.belief(self.namespace, marker.header.frame_id)
            if entity in self._ends:
                self._delete(entity, time_ns)  # what it was may have been of another kind
            lasts_ns = ns(marker.lifetime)
            self._ends[entity] = time_ns + lasts_ns if lasts_ns > 0 else None
            self._log(entity, time_ns, rr.CoordinateFrame(frame), shape)

    def _delete_over(self, time_ns: int) -> None:
        for entity, end in list(self._ends.items()):
            if end is not None and end <= time_ns:
                self._delete(entity, end)

    def _delete(self, entity: str, time_ns: int) -> None:
        if self._ends.pop(entity, 0) != 0:
            self._log(entity, time_ns, rr.Clear(recursive=False))

    def _log(self, entity: str, time_ns: int, *what: rr.AsComponents) -> None:
        self.recording.set_time(TIMELINE, duration=np.timedelta64(time_ns, "ns"))
        self.recording.log(entity, *what)


def drawn(marker: Any) -> rr.AsComponents | None:
    """Return a marker as Rerun has it, in the frame of its header; None if it is none that can be drawn."""
    pose = pose3_from_pose(marker.pose)
    size = np.array((marker.scale.x, marker.scale.y, marker.scale.z))
    points = pose.apply(np.array([(p.x, p.y, p.z) for p in marker.points], dtype=np.float64).reshape(-1, 3))
    colours = _colours(marker)
    turn = rr.Quaternion(xyzw=xyzw_from_wxyz(pose.quat_wxyz))
    kind = marker.type
    if kind == _ARROW:
        return _arrow(pose, points, size, colours)
    if kind in (_CUBE, _CUBE_LIST):
        centres = [pose.xyz] if kind == _CUBE else points
        return rr.Boxes3D(
            centers=centres, sizes=[size] * len(centres), quaternions=[turn] * len(centres), colors=colours,
            fill_mode="solid",
        )  # fmt: skip
    if kind in (_SPHERE, _SPHERE_LIST):
        centres = [pose.xyz] if kind == _SPHERE else points
        return rr.Ellipsoids3D(
            centers=centres, half_sizes=[size / 2.0] * len(centres), quaternions=[turn] * len(centres),
            colors=colours, fill_mode="solid",
        )  # fmt: skip
    if kind == _CYLINDER:
        return rr.Cylinders3D(
            centers=[pose.xyz], lengths=[size[2]], radii=[size[0] / 2.0], quaternions=[turn], colors=colours,
            fill_mode="solid",
        )  # fmt: skip
    if kind == _LINE_STRIP:
        return rr.LineStrips3D([points], colors=colours[:1], radii=[size[0] / 2.0])
    if kind == _LINE_LIST:
        pairs = points[: len(points) // 2 * 2].reshape(-1, 2, 3)
        shades = colours[::2] if len(colours) == len(points) else colours
        return rr.LineStrips3D(list(pairs), colors=shades, radii=[size[0] / 2.0])
    if kind == _POINTS:
        return rr.Points3D(points, colors=colours, radii=[max(size[0], size[1]) / 2.0])
    if kind == _TEXT:
        return rr.Points3D([pose.xyz], labels=[marker.text], colors=colours, radii=[0.0], show_labels=True)
    if kind == _TRIANGLES and len(points) >= 3:
        whole = points[: len(points) // 3 * 3]
        each = np.resize(np.array(colours, np.uint8), (len(whole), 4))
        return rr.Mesh3D(vertex_positions=whole, vertex_colors=each)
    return None


def _arrow(pose: Pose3, points: Array, size: Array, colours: list[tuple[int, ...]]) -> rr.Arrows3D:
    """Return an arrow: between two points whose shaft is scale.x thick, else along x, scale.x long."""
    if len(points) >= 2:
        start, vector, thick = points[0], points[1] - points[0], size[0]
    else:
        start, vector, thick = pose.xyz, pose.apply(np.array((size[0], 0.0, 0.0))) - pose.xyz, size[1]
    return rr.Arrows3D(origins=[start], vectors=[vector], colors=colours[:1], radii=[_SHAFT * thick])


def _colours(marker: Any) -> list[tuple[int, ...]]:
    """Return one for each point, or one for all."""
    given = marker.colors if len(marker.colors) == len(marker.points) and marker.colors else [marker.color]
    values: NDArray[np.float64] = np.array([(c.r, c.g, c.b, c.a) for c in given], dtype=np.float64)
    rows: list[list[int]] = np.round(255.0 * np.clip(np.nan_to_num(values), 0.0, 1.0)).astype(int).tolist()
    return [tuple(row) for row in rows]
