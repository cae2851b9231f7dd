"""The results of a sweep as a table: a row per run in the plan's order, however the runs were made."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from twin.experiments.sweep.axes import number
from twin.experiments.sweep.plan import Plan, PlannedRun
from twin.files.writing import replaced
from twin.scenario.quantities import quantity

COSTS = ("wall_time_s", "cpu_time_s", "real_time_factor", "pace_losses", "pace_lost_s")
"""Metrics that differ from one run to its repetition."""

_OF_CHECKS = {"": "value", ".passed": "passed", ".margin": "margin", ".at_s": "at_s", ".worst_s": "worst_s"}
"""Columns of a check -> keys of its result."""
_OPTIONAL = ("margin", "worst_s")
"""Keys that not every check has."""


@dataclass
class Column:
    """One column of the table."""

    values: list[Any]
    unit: str = ""


@dataclass
class Table:
    """The columns, in order; those of checks are `check.NAME`, `check.NAME.passed` and so on."""

    columns: dict[str, Column] = field(default_factory=dict)
    costs: dict[str, Column] = field(default_factory=dict)
    """What the runs cost, by the same keys: no two sweeps are equal in this."""
    checks: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    """A result of each check, for its unit and limit."""

    def __getitem__(self, name: str) -> list[Any]:
        return self.columns[name].values

    def shown(self, name: str, value: float | None) -> str:
        """Return a value of a check as people read it."""
        check = self.checks[name]
        return quantity(value, check["unit"], check["limit"])


def make_table(plan: Plan, runs: Sequence[tuple[PlannedRun, Mapping[str, Any]]]) -> Table:
    """Return the table of runs and their verdicts, a row each in the order given."""
    table = Table()
    columns = table.columns
    for axis in plan.axes:
        columns[axis.key] = parameter([plan.points[run.point][axis.key] for run, _ in runs])
    columns["seed"] = Column([run.seed for run, _ in runs])
    columns["verdict"] = Column([verdict["verdict"] for _, verdict in runs])
    columns["error"] = Column([verdict["error"] for _, verdict in runs])
    named = [by_name(verdict["checks"]) for _, verdict in runs]
    for checks in named:
        table.checks.update({name: check for name, check in checks.items() if name not in table.checks})
    for name, one in table.checks.items():
        for part, key in _OF_CHECKS.items():
            values = [checks[name].get(key) if name in checks else None for checks in named]
            if key not in _OPTIONAL or any(value is not None for value in values):
                unit = one["unit"] if key in ("value", "margin") else ""
                columns[f"check.{name}{part}"] = Column(_of_one_type(values), unit)
    metrics = dict.fromkeys(name for _, verdict in runs for name in verdict["metrics"])
    for name in metrics:
        column = Column([verdict["metrics"].get(name) for _, verdict in runs])
        if name in COSTS:
            table.costs[name] = column
        else:
            columns[f"metric.{name}"] = column
    columns["digest"] = Column([verdict["digest"] for _, verdict in runs])
    columns["key"] = Column([run.key for run, _ in runs])
    table.costs = {"key": columns["key"], **table.costs}
    return table


def parameter(texts: Sequence[str]) -> Column:
    """Return the values of a key: numbers, if all are such of one unit, otherwise the texts."""
    numbers = [number(text) for text in texts]
    units = {found[1] for found in numbers if found is not None}
    if None in numbers or len(units) != 1:
        return Column(list(texts))
    return Column([found[0] for found in numbers if found is not None], units.pop())


def by_name(checks: Sequence[Mapping[str, Any]]) -> dict[str, Mapping[str, Any]]:
    """Return checks by name; the second of a name is `NAME#2`."""
    seen: Counter[str] = Counter()
    named = {}
    for check in checks:
        seen[check["name"]] += 1
        count = seen[check["name"]]
        named[check["name"] if count == 1 else f"{check['name']}#{count}"] = check
    return named


def _of_one_type(values: list[Any]) -> list[Any]:
    """Return truth values as they are if there is nothing else; among numbers they are 0 and 1."""
    kinds = {type(value) for value in values if value is not None}
    return values if kinds <= {bool} else [None if value is None else float(value) for value in values]


def write_parquet(columns: Mapping[str, Column], file: Path) -> None:
    """Write columns, each with its unit in its metadata.

    Raises:
        OSError: The file cannot be written.
    """
    import pyarrow as pa  # type: ignore[import-untyped]
    import pyarrow.parquet as pq  # type: ignore[import-untyped]

    arrays, fields = [], []
    for name, column in columns.items():
        empty = all(value is None for value in column.values)
        array = pa.array(column.values, pa.string() if empty else None)
        arrays.append(array)
        fields.append(pa.field(name, array.type, metadata={"unit": column.unit} if column.unit else None))
    with replaced(file) as new:
        pq.write_table(pa.table(arrays, schema=pa.schema(fields)), new, compression="zstd")
