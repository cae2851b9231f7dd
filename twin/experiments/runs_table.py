"""The verdicts of many runs as a table."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow as pa  # type: ignore[import-untyped]

from twin.scenario.verdict import read_verdict, runs_in

_OF_A_RUN = ("test", "scenario", "seed", "verdict", "error", "digest", "command")
_OF_A_CHECK = ("passed", "value", "limit", "margin", "at_s", "unit")


def runs_table(folder: Path) -> pa.Table:
    """Return a row for each run below a folder, in the order of their paths.

    Columns are `run`, its folder from there; `test`, `scenario`, `seed`, `verdict`, `error`, `digest`,
    `command`; each metric, such as `sim_time_s`; of a check `<name>.passed`, `.value`, `.limit`, `.margin`,
    `.at_s`, `.unit`. What a run lacks is null.

    Raises:
        RecordingError: There is no run, or a verdict cannot be read.
    """
    rows = [_row(run, folder) for run in runs_in(folder)]
    names = dict.fromkeys(name for row in rows for name in row)
    return pa.table({name: pa.array([row.get(name) for row in rows], _type(name, rows)) for name in names})


def _row(run: Path, folder: Path) -> dict[str, Any]:
    verdict = read_verdict(run)
    row = {"run": run.relative_to(folder).as_posix()}
    row |= {key: verdict.get(key) for key in _OF_A_RUN} | verdict["metrics"]
    for check in verdict["checks"]:
        row |= dict(_told(check))
    return row


def _told(check: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    for key in _OF_A_CHECK:
        value = check.get(key)
        if value is not None and key in ("value", "limit", "margin"):
            value = float(value)  # of yes and no, too: a column has one type
        yield f"{check['name']}.{key}", value


def _type(name: str, rows: list[dict[str, Any]]) -> pa.DataType | None:
    """Return the type of a column that no run may fill; None: it shows."""
    if any(row.get(name) is not None for row in rows):
        return None
    return pa.float64() if name.endswith((".value", ".limit", ".margin", ".at_s")) else pa.string()
