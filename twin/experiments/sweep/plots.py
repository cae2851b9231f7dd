"""Pictures of a sweep, as SVG: pass rates and measured values over what was varied, paths of failing runs."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from twin.experiments.sequential import clopper_pearson
from twin.experiments.short_names import short_names
from twin.experiments.sweep.table import Column, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_GOOD, _BAD, _ODD, _LIMIT = "#2a9d5c", "#c8372d", "#8a3ffc", "#444444"
_COLOURS = {"pass": _GOOD, "fail": _BAD, "error": _ODD}
_WIDTH, _HEIGHT = 4.6, 2.4
"""Of a plot [inch]."""
_BINS = 10
"""A sampled interval's pass rates are those of so many parts of it."""
_MANY = 3000
"""More points than these are drawn as pixels."""
_MOST_CHECKS = 6
_TICKS = 7
"""Fewer values are named on their axis."""


def _figure(columns: int, rows: int, height: float = _HEIGHT) -> tuple[Figure, list[Axes]]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_WIDTH * columns, height * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False)
    for ax in axes.flat:
        ax.spines[["top", "right"]].set_visible(False)
        ax.grid(color="#e6e6e6", linewidth=0.7)
        ax.set_axisbelow(True)
    return figure, list(axes.flat)


def _svg(figure: Figure, salt: str) -> str:
    """Return a figure as SVG to stand in a page, the same for the same figure."""
    import matplotlib

    stream = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": salt, "svg.fonttype": "none"}):
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    return re.sub(r"^.*?(?=<svg)", "", stream.getvalue(), flags=re.DOTALL)


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
        yield f"over {key}", _svg(_over(table, column, label, checks), key)
    if len(varied) >= 2:
        first, second = varied[:2]
        if all(len(set(table[key])) <= 40 for key in (first, second)):
            drawn = _both(table, (first, second), (names[first], names[second]))
            yield f"pass rate over {first} and {second}", _svg(drawn, "both")
    if not varied and checks:
        yield "what was measured", _svg(_histograms(table, checks), "histograms")


def _places(column: Column) -> tuple[np.ndarray[Any, Any], list[str] | None]:
    """Return where values stand on an axis, and their names if they are no numbers."""
    if all(isinstance(value, float) for value in column.values):
        return np.array(column.values, dtype=float), None
    names = list(dict.fromkeys(map(str, column.values)))
    return np.array([names.index(str(value)) for value in column.values], dtype=float), names


def _over(table: Table, column: Column, label: str, checks: Sequence[str]) -> Figure:
    """Draw the pass rate and what each check measured over one parameter."""
    count = 1 + len(checks)
    columns = min(count, 2)
    figure, axes = _figure(columns, -(-count // columns))
    places, names = _places(column)
    verdicts = np.array(table["verdict"])
    for ax in axes:
        ax.set_xlabel(label)
        if names is not None:
            ax.set_xticks(range(len(names)), names, rotation=20 if len(names) > 4 else 0)
        elif len(np.unique(places)) <= _TICKS:
            ax.set_xticks(np.unique(places), [f"{place:g}" for place in np.unique(places)])
    _rates(axes[0], places, verdicts == "pass")
    for ax, name in zip(axes[1:], checks, strict=False):
        values = _numbers(table[f"check.{name}"])
        for verdict, colour in _COLOURS.items():
            chosen = verdicts == verdict
            raster = len(values) > _MANY
            ax.scatter(
                places[chosen], values[chosen], s=9, color=colour, alpha=0.6, linewidths=0, rasterized=raster
            )
        _measured(ax, table, name, ax.axhline)
        ax.set_ylabel(_title(table, name))
    for ax in axes[count:]:
        ax.set_visible(False)
    return figure


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
        color="#1f4e79",
        capsize=3,
        markersize=4,
    )
    ax.set_ylim(-4, 104)
    ax.set_ylabel("pass rate [%]")


def _both(table: Table, keys: tuple[str, str], names: tuple[str, str]) -> Figure:
    """Draw the pass rate over two parameters as coloured fields."""
    from matplotlib.colors import LinearSegmentedColormap

    colours = LinearSegmentedColormap.from_list("rates", [_BAD, "#f3ead2", _GOOD])
    figure, (ax,) = _figure(1, 1, 3.2)
    texts = [list(dict.fromkeys(table[key])) for key in keys]
    total = np.zeros((len(texts[1]), len(texts[0])))
    good = np.zeros_like(total)
    for x, y, verdict in zip(table[keys[0]], table[keys[1]], table["verdict"], strict=True):
        total[texts[1].index(y), texts[0].index(x)] += 1
        good[texts[1].index(y), texts[0].index(x)] += verdict == "pass"
    with np.errstate(invalid="ignore"):
        image = ax.imshow(100 * good / total, cmap=colours, vmin=0, vmax=100, origin="lower", aspect="auto")
    for axis, name, values in zip((ax.xaxis, ax.yaxis), names, texts, strict=True):
        axis.set_ticks(range(len(values)), [f"{v:g}" if isinstance(v, float) else str(v) for v in values])
        axis.set_label_text(name)
    ax.grid(visible=False)
    figure.colorbar(image, label="pass rate [%]")
    return figure


def _histograms(table: Table, checks: Sequence[str]) -> Figure:
    columns = min(len(checks), 2)
    figure, axes = _figure(columns, -(-len(checks) // columns))
    verdicts = np.array(table["verdict"])
    for ax, name in zip(axes, checks, strict=False):
        values = _numbers(table[f"check.{name}"])
        there = ~np.isnan(values)
        edges = np.histogram_bin_edges(values[there], bins=min(30, max(5, int(there.sum() ** 0.5) * 2)))
        parts = {verdict: values[there & (verdicts == verdict)] for verdict in _COLOURS}
        ax.hist(list(parts.values()), bins=list(edges), stacked=True, color=list(_COLOURS.values()))
        _measured(ax, table, name, ax.axvline)
        ax.set_xlabel(_title(table, name))
        ax.set_ylabel("runs")
    for ax in axes[len(checks) :]:
        ax.set_visible(False)
    return figure


def _measured(ax: Axes, table: Table, name: str, line: Any) -> None:
    """Draw the limit of a check, if that is near enough to what was measured."""
    limit = table.checks[name]["limit"]
    values = _numbers(table[f"check.{name}"])
    if isinstance(limit, bool) or limit is None or not np.isfinite(values).any():
        return
    reach = max(np.nanmax(np.abs(values)), 1e-12)
    if abs(limit) <= 4.0 * reach:
        line(limit, color=_LIMIT, linestyle="--", linewidth=1.0)


def _title(table: Table, name: str) -> str:
    unit = table.checks[name]["unit"]
    return f"{name} [{unit}]" if unit else name


def _numbers(values: Sequence[Any]) -> np.ndarray[Any, Any]:
    return np.array([np.nan if value is None else float(value) for value in values])


def paths(recording: Path) -> str | None:
    """Return the ways of the robots of a recording as SVG, in `map`; None if it has none.

    Raises:
        RecordingError: It cannot be read.
    """
    from twin.recording.read_back import read

    columns = read(recording).columns
    figure, (ax,) = _figure(1, 1, 3.6)
    drawn = False
    for kind, style in (("truth", "-"), ("estimate", "--")):
        for entity in sorted(columns):
            found = re.fullmatch(rf"/trails/(\w+)/{kind}", entity)
            strips = columns[entity].get("LineStrips3D:strips") if found else None
            if found is None or strips is None:
                continue
            points = np.array([point[:2] for row in strips.values for strip in row for point in strip])
            if len(points) == 0:
                continue
            colour = "#1f4e79" if kind == "truth" else "#e08e1b"
            ax.plot(*points.T, style, color=colour, linewidth=1.2, label=f"{found[1]}, {kind}")
            if kind == "truth":
                ax.plot(*points[0], "o", color=_GOOD, markersize=6)
                ax.plot(*points[-1], "X", color=_BAD, markersize=7)
            drawn = True
    if not drawn:
        return None
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel("x [m]")
    ax.set_ylabel("y [m]")
    ax.legend(fontsize=8, frameon=False)
    return _svg(figure, str(recording.parent.name))
