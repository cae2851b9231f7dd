"""One of two runs that are compared: kept in a folder, or made now."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from twin.errors import RecordingError, ScenarioError
from twin.plugins import execution
from twin.recording.hashes import HASHES
from twin.runtime.kept_run import KeptRun
from twin.runtime.open_run import OpenRun
from twin.scenario import catalogue
from twin.scenario.outside import Outside
from twin.scenario.schema import Scenario, load, load_again

if TYPE_CHECKING:
    from twin.runtime import Progress

Overrides = Mapping[str, str]
NO_OVERRIDES: Overrides = MappingProxyType({})


@dataclass(frozen=True, kw_only=True)
class Side:
    """A run as far as comparisons know it."""

    name: str
    """How the user calls it."""
    run: KeptRun

    @property
    def is_alone(self) -> bool:
        """Whether all that took part is known."""
        return self.run.provenance.clock == "inproc" and bool(self.run.provenance.scenario)

    def scenario(self, overrides: Overrides = NO_OVERRIDES) -> Scenario:
        """Return its scenario; executes plugins. Raises TwinError where that is wrong by now."""
        return load_again(self.run.provenance.source, overrides, execute=True)

    @property
    def outside(self) -> Outside:
        """The user's own nodes."""
        return Outside(nodes=self.run.provenance.nodes)


def sides(
    a: str | Path,
    b: str | Path | None = None,
    overrides: Overrides = NO_OVERRIDES,
    progress: Callable[[Progress], None] | None = None,
) -> tuple[Side, Side]:
    """Return the runs that two paths mean; what is wrong with either is told before one is made.

    Args:
        a: See `of_path`.
        b: Another; None: `a`, made again now.
        overrides: Of the scenario of `b`.
        progress: Called about four times a second of a run.

    Raises:
        TwinError: See `of_path`.
    """
    for path, changes in ((a, NO_OVERRIDES), (a if b is None else b, overrides)):
        if not _is_kept(Path(path)):
            load(_scenario(path), changes)
        elif b is not None:
            of_path(path, changes)
    one = of_path(a, progress=progress)
    return one, made_again(one, overrides, progress) if b is None else of_path(b, overrides, progress)


def of_path(
    path: str | Path, overrides: Overrides = NO_OVERRIDES, progress: Callable[[Progress], None] | None = None
) -> Side:
    """Return the run that a path means.

    Args:
        path: Folder of a run, or its `hashes.json`; or name or file of a scenario, which is run now.
        overrides: Dotted keys -> values that go into the scenario before it is run.
        progress: Called about four times a second of a run.

    Raises:
        TwinError: There is no such thing, the run cannot be made, or has been made already and is to change.
    """
    path = Path(path)
    if _is_kept(path):
        if overrides:
            raise RecordingError(f"{path}: this run is over; overrides are for a scenario that is run now")
        return Side(name=str(path), run=KeptRun.read(path / HASHES if path.is_dir() else path))
    with execution():
        scenario = load(_scenario(path), overrides, execute=True)
        name = " ".join([str(path), *(f"{key}={value}" for key, value in overrides.items())])
        return Side(name=name, run=_made(scenario, Outside(), progress))


def _is_kept(path: Path) -> bool:
    return path.is_dir() or path.suffix == ".json"


def _scenario(path: str | Path) -> Path:
    try:
        return catalogue.resolve(path)
    except ScenarioError as fault:
        raise ScenarioError(f"{path}: no folder of a run, and {fault}") from None


def made_again(
    side: Side, overrides: Overrides = NO_OVERRIDES, progress: Callable[[Progress], None] | None = None
) -> Side:
    """Return the same run made now, perhaps with changes.

    Raises:
        TwinError: It cannot be made.
    """
    if not side.is_alone:
        raise RecordingError(f"{side.name}: {why_not_alone(side)}; it cannot be made again")
    changes = [f"{key}={value}" for key, value in overrides.items()] or ["now"]
    with execution():
        return Side(
            name=" ".join([side.name, *changes]), run=_made(side.scenario(overrides), side.outside, progress)
        )


def why_not_alone(side: Side) -> str:
    """Return why a run cannot be made again."""
    if side.run.provenance.clock != "inproc":
        return "other processes took part in that run"
    return "the scenario of that run was not read from a file"


def _made(scenario: Scenario, outside: Outside, progress: Callable[[Progress], None] | None) -> KeptRun:
    run = OpenRun(scenario, record=False, outside=outside)
    try:
        run.advance_to_end(progress)
        run.finish()
        return run.kept()
    finally:
        run.close()
