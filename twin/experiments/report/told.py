"""What a run's folder tells: its verdict, and what its recording shows over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twin.errors import RecordingError
from twin.geometry import Array
from twin.recording.read_back import Recording, read
from twin.recording.scene import RecordedScene
from twin.scenario.quantities import quantity
from twin.scenario.verdict import VERDICT, read_verdict
from twin.scenario.verdict_text import moment_of

_BAD = ("WARN", "ERROR", "CRITICAL")
_MOST_MOMENTS = 6
_END_S = 1.5
"""A check that was decided so shortly before the end was decided by it [s]."""


class State(NamedTuple):
    """A state of the mission, and until when."""

    start_s: float
    end_s: float
    name: str


class Line(NamedTuple):
    """A line of the log."""

    time_s: float
    level: str
    text: str


class Series(NamedTuple):
    """A number over time."""

    name: str
    times_s: Array
    """Shape (n,) [s]."""
    values: Array
    """Shape (n,)."""


class Map(NamedTuple):
    """The last map of a run."""

    cells: Array
    """Shape (height, width), from below: 0 free to 100 occupied, 255 unknown."""
    extent: tuple[float, float, float, float]
    """Left, right, bottom, top [m]."""


@dataclass(frozen=True)
class Moment:
    """A moment that is worth a look."""

    time_s: float
    title: str
    text: str = ""
    bad: bool = False


@dataclass(frozen=True, kw_only=True)
class Told:
    """One run."""

    folder: Path
    verdict: Mapping[str, Any]
    recording: Recording | None
    missing: str
    """Why there is no recording, if there is none; a sentence."""

    @property
    def title(self) -> str:
        """The name of the test, or of the scenario."""
        return str(self.verdict.get("test") or self.verdict["scenario"])

    @property
    def word(self) -> str:
        """`pass`, `fail` or `error`."""
        return str(self.verdict["verdict"])

    @property
    def written(self) -> str:
        """When the run ended, on the wall."""
        return datetime.fromtimestamp((self.folder / VERDICT).stat().st_mtime).strftime("%Y-%m-%d %H:%M")

    @cached_property
    def end_s(self) -> float:
        """Simulated time at the end [s]."""
        known = [float(self.verdict["metrics"].get("sim_time_s", 0.0))]
        known += [float(times[-1]) * 1e-9 for times, _ in self.scene.paths.values()] if self.scene else []
        return max(known)

    @cached_property
    def scene(self) -> RecordedScene | None:
        """What was where."""
        return None if self.recording is None else RecordedScene(self.recording)

    @cached_property
    def robots(self) -> tuple[str, ...]:
        """Names of the robots of which there is a trail."""
        return tuple(dict.fromkeys(path.split("/")[2] for path in self._entities("/trails/")))

    def base(self, robot: str) -> str:
        """Return the body that stands for a robot."""
        known = {} if self.scene is None else self.scene.paths
        links = [name for name in known if name.startswith(f"{robot}/")]
        wanted = (f"{robot}/base_footprint", f"{robot}/base_link")
        return next((name for name in wanted if name in links), links[0] if links else "")

    def truth(self, robot: str) -> tuple[Array, Array]:
        """Return times [s], shape (n,), and true positions in `map`, shape (n, 2) [m]."""
        if self.scene is None or self.base(robot) not in self.scene.paths:
            return np.zeros(0), np.zeros((0, 2))
        times, poses = self.scene.paths[self.base(robot)]
        return _seconds(times), poses[:, :2]

    def trail(self, robot: str, kind: str) -> Array:
        """Return the trail `estimate` or `odometry` of a robot, shape (n, 2) [m]."""
        return _joined(self._strips(f"/trails/{robot}/{kind}"))

    @cached_property
    def plans(self) -> list[Array]:
        """All plans of navigation, each of shape (n, 2) [m]."""
        return [
            line for path in self._entities("/ros/") if path.endswith("/plan") for line in self._strips(path)
        ]

    @cached_property
    def map(self) -> Map | None:
        """The last map that was published."""
        for path in self._entities("/ros/"):
            if not path.endswith("/map") or "GridMap:data" not in self._columns(path):
                continue
            part = {name.partition(":")[2]: each for name, each in self._columns(path).items()}
            form = part["format"].array[-1].as_py()[0]
            shape = form["height"], form["width"]
            cells = np.asarray(part["data"].array[-1].values[0].values.to_numpy()).reshape(shape)
            size, (left, below, _) = part["cell_size"].array[-1].as_py()[0], part["translation"].values[-1][0]
            extent = (left, left + size * shape[1], below, below + size * shape[0])
            return Map(cells[::-1], extent)
        return None

    @cached_property
    def states(self) -> list[State]:
        """The states of the mission."""
        found: list[State] = []
        for path in self._entities("/"):
            if path.endswith("mission/state") and "StateChange:state" in self._columns(path):
                column = self._columns(path)["StateChange:state"]
                times = [*(column.times_ns * 1e-9), max(self.end_s, column.times_ns[-1] * 1e-9)]
                names = [row[0].rpartition(": ")[2] for row in column.values]
                found += map(State, times, times[1:], names)
        return found

    @property
    def sights(self) -> list[tuple[float, str]]:
        """Times [s] and names of what is to be seen: start, end, moments, then states of the mission."""
        found = [(0.0, "start"), (self.end_s, "end")]
        found += [(moment.time_s, f"{i}: {moment.title}") for i, moment in enumerate(self.moments, 1)]
        return found + [((state.start_s + state.end_s) / 2.0, state.name) for state in self.states]

    @cached_property
    def log(self) -> list[Line]:
        """What nodes said."""
        columns = self._columns("/log")
        if "TextLog:text" not in columns:
            return []
        text, level = columns["TextLog:text"], columns["TextLog:level"]
        rows = zip(text.times_ns * 1e-9, level.values, text.values, strict=True)
        return [Line(float(time), levels[0], texts[0]) for time, levels, texts in rows]

    def series(self, prefix: str) -> list[Series]:
        """Return the numbers below a path, named by the rest of their own."""
        found = []
        for path in self._entities(prefix):
            if self.recording is not None and "Scalars:scalars" in self._columns(path):
                times, values = self.recording.scalars(path)
                found.append(Series(path.removeprefix(prefix).strip("/"), _seconds(times), values))
        return found

    @cached_property
    def moments(self) -> list[Moment]:
        """What is worth a look, in the order of time: what failed, what came near to it, warnings."""
        found = []
        for check in self.verdict["checks"]:
            at, value = moment_of(check), check["value"]
            shows = isinstance(value, float) and value != 0.0  # neither yes or no, nor nothing at all
            if at is None or (check["passed"] and (at > self.end_s - _END_S or not shows)):
                continue
            title = check["name"] if check["passed"] else f"{check['name']} fails"
            text = check["reason"] or "nearest to its limit"
            if check.get("margin") is not None:
                text += f", margin {quantity(check['margin'], check['unit'], check['limit'])}"
            found.append(Moment(float(at), title, text, not check["passed"]))
        found += [
            Moment(float(fault["at_s"]), f"fault {fault['name']}", fault["effect"])
            for fault in self.verdict.get("faults", ())
            if fault["at_s"]
        ]
        for robot in self.robots:
            for name, times, values in self.series(f"/localisation/{robot}/"):
                if name == "position_error" and len(values):
                    most = int(np.argmax(values))
                    text = f"{robot}: {values[most] * 1e3:.0f} mm"
                    found.append(Moment(float(times[most]), "largest localisation error", text))
        loud = [line for line in self.log if line.level in _BAD and "[faults]" not in line.text][:4]
        found += [Moment(at, level.lower(), text, level != "WARN") for at, level, text in loud]
        found.sort(key=lambda moment: not moment.bad)
        return sorted(found[:_MOST_MOMENTS], key=lambda moment: moment.time_s)

    def state_at(self, time_s: float) -> str:
        """Return what the mission was about."""
        return next((s.name for s in reversed(self.states) if s.start_s <= time_s), "")

    def _columns(self, path: str) -> Mapping[str, Any]:
        return {} if self.recording is None else self.recording.columns.get(path, {})

    def _entities(self, prefix: str) -> list[str]:
        return [] if self.recording is None else [e for e in self.recording.entities if e.startswith(prefix)]

    def _strips(self, path: str) -> list[Array]:
        column = self._columns(path).get("LineStrips3D:strips")
        return [] if column is None else [np.array(line)[:, :2] for row in column.values for line in row]


def read_run(folder: Path) -> Told:
    """Read the folder of a run.

    Raises:
        RecordingError: It holds no verdict, or one that cannot be read.
    """
    verdict = read_verdict(folder)
    recording, missing = None, "The run was not recorded."
    if files := sorted(folder.glob("*.rrd")):
        try:
            recording = read(files[0])
        except RecordingError as fault:
            missing = f"{fault}."
    return Told(folder=folder, verdict=verdict, recording=recording, missing=missing)


def _seconds(times_ns: NDArray[np.int64]) -> Array:
    return np.asarray(times_ns * 1e-9, dtype=np.float64)


def _joined(strips: list[Array]) -> Array:
    """Return one line of segments that follow each other."""
    return np.concatenate([strips[0], *(s[1:] for s in strips[1:])]) if strips else np.zeros((0, 2))
