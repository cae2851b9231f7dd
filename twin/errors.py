"""Every error a user can act on, on one page.

TwinError
├── ModelError        a robot file (URDF, xacro, mesh) cannot be used
├── ConversionError   a robot description has no faithful MuJoCo model
├── ScenarioError     a scenario or arena file is wrong
├── MapError          a map file is wrong
├── CloudError        a file of points is wrong, or points lack what is to be done with them
├── NavigationError   a behaviour tree or a file of Nav2 parameters is wrong
├── TaskError         a robot cannot do a task, or a queue holds none that is meant
├── BridgeError       the bus: a port in use, an unknown message type, an invalid name
├── PluginError       a user's plugin lacks something, cannot be found, or fails while it runs
├── RecordingError    a recording cannot be written or read
├── GymError          a gymnasium environment was made or used wrongly
└── SimulationError   the physics cannot go on (diverged)

The message is one sentence: what, where (file:line), what would be valid. `twin` prints it on stderr and
exits 2; anything else that escapes is a bug and keeps its traceback.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

MANY, SHOWN = 30, 20
"""Of more names than this in a message only so many are told."""
ALIKE = 5
"""Or, where one was meant, so many that are like it."""
COMPARED = 200
"""Up to so many names, the nearest one is looked for."""


class SourceLine(int):
    """A 1-based line together with the file it is in, which need not be the one that was asked for."""

    file: Path

    def __new__(cls, line: int, file: Path) -> SourceLine:
        """Return line `line` of `file`."""
        self = super().__new__(cls, line)
        self.file = file
        return self

    def __getnewargs__(self) -> tuple[int, Path]:  # type: ignore[override]
        return int(self), self.file


@dataclass(frozen=True)
class Problem:
    """One fault in an input file."""

    message: str
    """One sentence: what is wrong and what would be valid."""
    file: Path | None = None
    line: int | None = None
    """1-based line in `file`; a `SourceLine` brings its own file."""
    code: str = ""
    """Stable name of this kind of fault, such as `two-parents`; only robot files have them."""
    element: str = ""
    """What it is about, such as `joint 'lift_joint'`."""

    def __post_init__(self) -> None:
        if isinstance(self.line, SourceLine):
            object.__setattr__(self, "file", self.line.file)
            object.__setattr__(self, "line", int(self.line))

    def __str__(self) -> str:
        if self.file is None:
            return self.message
        where = str(self.file) if self.line is None else f"{self.file}:{self.line}"
        return f"{where}: {self.message}"


class TwinError(Exception):
    """Base of all errors a user can act on; carries every problem found, not only the first."""

    def __init__(self, problems: str | Problem | Iterable[Problem]) -> None:
        if isinstance(problems, str):
            problems = Problem(problems)
        self.problems: tuple[Problem, ...] = (problems,) if isinstance(problems, Problem) else tuple(problems)
        super().__init__("\n".join(map(str, self.problems)))


class ModelError(TwinError):
    """A robot file cannot be used."""


class ConversionError(TwinError):
    """A robot description has no faithful MuJoCo model."""


class ScenarioError(TwinError):
    """A scenario or arena file is wrong."""


class MapError(TwinError):
    """A map file is wrong."""


class CloudError(TwinError):
    """A file of points is wrong, or points lack what is to be done with them."""


class NavigationError(TwinError):
    """A behaviour tree or a file of Nav2 parameters is wrong."""


class TaskError(TwinError):
    """A robot cannot do a task, or its queue holds none that is meant."""


class BridgeError(TwinError):
    """The bus cannot do what was asked: a port in use, an unknown type, an invalid name."""


class NobodyAnswersError(BridgeError):
    """Nobody listens at the endpoints of a client."""


class PluginError(TwinError):
    """A user's plugin lacks something, cannot be found, or fails while it runs."""


class RecordingError(TwinError):
    """A recording cannot be written or read."""


class GymError(TwinError, ValueError):
    """A gymnasium environment was made or used wrongly."""


class SimulationError(TwinError):
    """The physics cannot go on."""


def nearest(word: str, valid: Iterable[str]) -> str:
    """Return the tail of an error message that lists valid names, of many only those nearest to a word.

    >>> nearest("lidr", ["imu", "lidar"])
    "did you mean 'lidar'? Valid: imu, lidar"
    >>> nearest("rang_7", [f"range_{i}" for i in range(100)])
    "did you mean 'range_7'? Valid: range_7, range_97, range_87, range_79, range_78, and 95 more"
    >>> nearest("dock", [])
    'there are none'
    """
    import difflib

    names = sorted(valid)
    if not names:
        return "there are none"
    # Comparing very many names takes long, as a file may name as many unknown ones.
    likely = names if len(names) <= COMPARED else [name for name in names if name.lower() == word.lower()]
    close = difflib.get_close_matches(word, likely, n=ALIKE, cutoff=0.5)
    hint = f"did you mean '{close[0]}'? " if close else ""
    if close and len(names) > MANY:
        return f"{hint}Valid: {', '.join(close)}, and {len(names) - len(close)} more"
    return f"{hint}Valid: {shortened(names)}"


def shortened(names: Sequence[str]) -> str:
    """Return names for a message, of many only the first.

    >>> shortened(["imu", "lidar"])
    'imu, lidar'
    """
    more = [f"and {len(names) - SHOWN} more"] if len(names) > MANY else []
    return ", ".join([*names[: SHOWN if more else None], *more])
