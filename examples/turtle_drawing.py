"""The turtles in Rerun: sheet, turtles and their lines."""

from __future__ import annotations

import math
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
from turtle_world import METER, SIZE, Sheet, Turtle

Rgb = tuple[int, int, int]


class Drawing:
    """Writes a recording for `twin play` or `rerun`; Rerun's 2-D views count y from the top."""

    def __init__(self, file: Path) -> None:
        self._recording = rr.RecordingStream("turtlesim")
        self._recording.save(file)
        self._background: Rgb | None = None
        self._names: set[str] = set()
        self._strokes = 0

    def show(self, turtles: dict[str, Turtle], sheet: Sheet, background: Rgb, time_ns: int) -> None:
        """Draw everything as it is at a time [ns]."""
        recording = self._recording
        recording.set_time("time", timestamp=time_ns * 1e-9)
        if background != self._background:
            self._background = background
            view = rrb.Spatial2DView(origin="/", name="TurtleSim", background=[*background, 255])
            recording.send_blueprint(rrb.Blueprint(view, collapse_panels=True))
            recording.log("sheet", rr.Boxes2D(mins=[[0, 0]], sizes=[[SIZE, SIZE]], colors=[background]))
        for gone in self._names - turtles.keys():
            recording.log(f"turtles/{gone}", rr.Clear(recursive=True))
        self._names = set(turtles)
        for name, turtle in turtles.items():
            at, ahead = (turtle.x, SIZE - turtle.y), (math.cos(turtle.theta), -math.sin(turtle.theta))
            recording.log(f"turtles/{name}", rr.Arrows2D(origins=[at], vectors=[ahead], labels=[name]))
        if len(sheet.strokes) != self._strokes:
            self._strokes = len(sheet.strokes)
            recording.log("lines", _lines(sheet))

    def close(self) -> None:
        """Write what is left."""
        self._recording.flush()
        self._recording.disconnect()


def _lines(sheet: Sheet) -> rr.LineStrips2D:
    """Return the strokes, those that continue each other as one strip."""
    strips: list[list[tuple[float, float]]] = []
    colors, radii = [], []
    last = None
    for stroke in sheet.strokes:
        if last is None or last.end != stroke.start or last.pen != stroke.pen:
            strips.append([_flipped(stroke.start)])
            colors.append((stroke.pen.r, stroke.pen.g, stroke.pen.b))
            radii.append(stroke.pen.width / 2.0 / METER)
        strips[-1].append(_flipped(stroke.end))
        last = stroke
    return rr.LineStrips2D(strips, colors=colors, radii=radii)


def _flipped(point: tuple[float, float]) -> tuple[float, float]:
    return point[0], SIZE - point[1]
