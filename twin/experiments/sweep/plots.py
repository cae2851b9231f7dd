"""Pictures of a sweep, as SVG: pass rates and measured values over what was varied."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from twin.experiments.report.figures import ROLES, WIDTH, figure, svg
from twin.experiments.sequential import clopper_pearson
from twin.experiments.short_names import short_names
from twin.experiments.sweep.table import Column, Table
from twin.scenario.quantities import in_degrees

_GOOD, _BAD, _ODD = "#2a9d5c", "#c8372d", "#8a3ffc"
"""Of what is drawn as pixels."""
_COLOURS = {"pass": (ROLES["good"], _GOOD), "fail": (ROLES["bad"], _BAD), "error": (ROLES["odd"], _ODD)}
_HEIGHT = 2.4
"""Of a plot [inch]."""
_BINS = 10
"""A sampled interval's pass rates are those of so many parts of it."""
_MANY = 3000
"""More points than these are drawn as pixels."""
_MOST_CHECKS = 6
_TICKS = 7
"""Fewer values are named on their axis."""


@contextmanager
def _axes(columns: int, count: int, height: float = _HEIGHT) -> Iterator[tuple[Figure, list[Axes]]]:
    """Yield a figure and so many axes, in rows."""
    rows = -(-count // columns)
    with figure((WIDTH, height * rows)) as drawn:
        axes = list(drawn.subplots(rows, columns, squeeze=False).flat)
        for ax in axes:
            ax.grid(color=ROLES["line"], linewidth=0.7)
        for ax in axes[count:]:
            ax.set_visible(False)
        yield drawn, axes


def plots(table: Table, keys: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield a title and an SVG for each thing that can be seen in a table.

    Args:
        table: Of the sweep.
        keys: Its columns that were varied.
    """
    names = short_names(keys)
    varied = [key for key in keys if len(set(table[key])) > 1]
    checks = [
        name for name in table.checks if any(isinstance(value, float) for value in table[f"check.{name}"])
    ][:_MOST_CHECKS]
    for key in varied:
        column = table.columns[key]
        label = names[key] + (f" [{column.unit}]" if column.unit else "")
        yield f"over {key}", _over(table, column, label, checks)
    if len(varied) >= 2:
        first, second = varied[:2]
        if all(len(set(table[key])) <= 40 for key in (first, second)):
            drawn = _both(table, (first, second), (names[first], names[second]))
            yield f"pass rate over {first} and {second}", drawn
    if not varied and checks:
        yield "what was measured", _histograms(table, checks)


def _places(column: Column) -> tuple[np.ndarray[Any, Any], list[str] | None]:
    """Return where values stand on an axis, and their names if they are no numbers."""
    if all(isinstance(value, float) for value in column.values):
        return np.array(column.values, dtype=float), None
    names = list(dict.fromkeys(map(str, column.values)))
    return np.array([names.index(str(value)) for value in column.values], dtype=float), names


def _over(table: Table, column: Column, label: str, checks: Sequence[str]) -> str:
    """Draw the pass rate and what each check measured over one parameter."""
    places, names = _places(column)
    verdicts = np.array(table["verdict"])
    with _axes(2 if checks else 1, 1 + len(checks)) as (drawn, axes):
        for ax in axes:
            ax.set_xlabel(label)
            if names is not None:
                ax.set_xticks(range(len(names)), names, rotation=20 if len(names) > 4 else 0)
            elif len(np.unique(places)) <= _TICKS:
                ax.set_xticks(np.unique(places), [f"{place:g}" for place in np.unique(places)])
        _rates(axes[0], places, verdicts == "pass")
        for ax, name in zip(axes[1:], checks, strict=False):
            values = _measures(table, name)
            raster = len(values) > _MANY
            for verdict, colours in _COLOURS.items():
                x, y = places[verdicts == verdict], values[verdicts == verdict]
                ax.scatter(x, y, s=9, color=colours[raster], alpha=0.6, linewidths=0, rasterized=raster)
            _measured(ax, table, name, ax.axhline)
            ax.set_ylabel(_title(table, name))
        return svg(drawn, f"Pass rate and what was measured over {label}")


def _rates(ax: Axes, places: np.ndarray[Any, Any], passed: np.ndarray[Any, Any]) -> None:
    at = np.unique(places)
    if len(at) > 4 * _BINS:  # samples, of which no two are alike
        edges = np.linspace(places.min(), places.max(), _BINS + 1)
        group = np.clip(np.digitize(places, edges) - 1, 0, _BINS - 1)
        at, which = (edges[1:] + edges[:-1]) / 2.0, [group == index for index in range(_BINS)]
    else:
        which = [places == place for place in at]
    there = [(place, int(passed[mask].sum()), int(mask.sum())) for place, mask in zip(at, which, strict=True)]
    there = [each for each in there if each[2]]
    rates = np.array([good / count for _, good, count in there])
    bounds = np.array([clopper_pearson(good, count) for _, good, count in there])
    errors = np.abs(bounds.T - rates)
    ax.errorbar(
        [each[0] for each in there],
        100 * rates,
        100 * errors,
        fmt="o-",
        color=ROLES["plan"],
        capsize=3,
        markersize=4,
    )
    ax.set_ylim(-4, 104)
    ax.set_ylabel("pass rate [%]")


def _both(table: Table, keys: tuple[str, str], names: tuple[str, str]) -> str:
    """Draw the pass rate over two parameters as coloured fields."""
    colours = LinearSegmentedColormap.from_list("rates", [_BAD, "#f3ead2", _GOOD])
    texts = [list(dict.fromkeys(table[key])) for key in keys]
    total = np.zeros((len(texts[1]), len(texts[0])))
    good = np.zeros_like(total)
    for x, y, verdict in zip(table[keys[0]], table[keys[1]], table["verdict"], strict=True):
        total[texts[1].index(y), texts[0].index(x)] += 1
        good[texts[1].index(y), texts[0].index(x)] += verdict == "pass"
    with _axes(1, 1, 3.2) as (drawn, (ax,)):
        with np.errstate(invalid="ignore"):
            image = ax.imshow(
                100 * good / total, cmap=colours, vmin=0, vmax=100, origin="lower", aspect="auto"
            )
        for axis, name, values in zip((ax.xaxis, ax.yaxis), names, texts, strict=True):
            axis.set_ticks(range(len(values)), [f"{v:g}" if isinstance(v, float) else str(v) for v in values])
            axis.set_label_text(name)
        ax.grid(visible=False)
        drawn.colorbar(image, label="pass rate [%]")
        return svg(drawn, f"Pass rate over {names[0]} and {names[1]}")


def _histograms(table: Table, checks: Sequence[str]) -> str:
    verdicts = np.array(table["verdict"])
    with _axes(min(len(checks), 2), len(checks)) as (drawn, axes):
        for ax, name in zip(axes, checks, strict=False):
            values = _measures(table, name)
            there = ~np.isnan(values)
            edges = np.histogram_bin_edges(values[there], bins=min(30, max(5, int(there.sum() ** 0.5) * 2)))
            parts = [values[there & (verdicts == verdict)] for verdict in _COLOURS]
            ax.hist(parts, bins=list(edges), stacked=True, color=[role for role, _ in _COLOURS.values()])
            _measured(ax, table, name, ax.axvline)
            ax.set_xlabel(_title(table, name))
            ax.set_ylabel("runs")
        return svg(drawn, "What was measured")


def _measured(ax: Axes, table: Table, name: str, line: Any) -> None:
    """Draw the limit of a check, if that is near enough to what was measured."""
    limit = table.checks[name]["limit"]
    values = _measures(table, name)
    if isinstance(limit, bool) or limit is None or not np.isfinite(values).any():
        return
    limit, _ = in_degrees(limit, table.checks[name]["unit"])
    reach = max(np.nanmax(np.abs(values)), 1e-12)
    if abs(limit) <= 4.0 * reach:
        line(limit, color=ROLES["muted"], linestyle="--", linewidth=1.0)


def _title(table: Table, name: str) -> str:
    _, unit = in_degrees(0.0, table.checks[name]["unit"])
    return f"{name} [{unit}]" if unit else name


def _measures(table: Table, name: str) -> np.ndarray[Any, Any]:
    """Return what a check measured in each run, in the unit of its title; NaN: nothing."""
    scale, _ = in_degrees(1.0, table.checks[name]["unit"])
    values = (np.nan if value is None else float(value) for value in table[f"check.{name}"])
    return scale * np.fromiter(values, dtype=float)
