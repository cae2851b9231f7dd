"""What scripts read: scenarios, arenas, recordings, bags."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pyarrow as pa  # type: ignore[import-untyped]

    from twin.recording.read_back import Recording
    from twin.scenario.schema import Scenario
    from twin.warehouse.arena import Arena


def load_arena(name_or_path: str | Path) -> Arena:
    """Read an arena: its poses, racks, zones and totes by name.

    Args:
        name_or_path: Of an arena that comes with twin, or a file.

    Raises:
        ScenarioError: With every problem of the file, each with its line.
    """
    from twin.warehouse import arena

    return arena.load(name_or_path)


def load_scenario(
    scenario: Scenario | str | Path,
    overrides: Mapping[str, Any] = MappingProxyType({}),
    *,
    execute: bool = False,
) -> Scenario:
    """Read a scenario.

    Args:
        scenario: Name of one that ships with twin or is in the folder `scenarios`, or a file; what was read
            already is returned as it is, if nothing is to be changed.
        overrides: Dotted keys of the file -> values that go before its own, as in
            `{"robots.0.pose.x": 1.5, "duration": "2 min", "checks.0.energy": {"max": "3 J"}}`.
        execute: Whether the plugins that it names are executed, to check their parameters; else they are
            found by reading, and a run executes them.

    Raises:
        ScenarioError: With every problem of the file and of the overrides, each with its line.
    """
    from twin.scenario.overrides import read_scenario

    return read_scenario(scenario, overrides, execute=execute)


def read_runs(folder: str | Path) -> pa.Table:
    """Read the verdicts of all runs below a folder, as `twin test` writes them: an Arrow table.

    It has a row for each run, with `test`, `scenario`, `seed`, `verdict`, the metrics, and of each check
    `<name>.passed`, `.value`, `.limit`, `.margin`; `to_pandas()` and `polars.from_arrow` make frames of it.

    Args:
        folder: Of one run, or of many.

    Raises:
        RecordingError: There is no run, or a verdict cannot be read.
    """
    from twin.experiments.runs_table import runs_table

    return runs_table(Path(folder))


def read_recording(path: str | Path) -> Recording:
    """Read a Rerun recording: columns of numpy arrays by entity and component.

    Args:
        path: Of an `.rrd` file.

    Raises:
        RecordingError: It is missing, not a recording, or empty.
    """
    from twin.recording.read_back import read

    return read(Path(path))
