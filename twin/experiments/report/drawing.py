"""Pictures of a run."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from twin.experiments.report.figures import ROLES, WIDTH, figure, svg
from twin.experiments.report.told import Moment, Series, Told
from twin.geometry import Array, matrix_from_quat_wxyz
from twin.models.shapes import Box, Cylinder, Sphere

_POINTS = 1200
"""Of a line; more cannot be seen, and make the file large."""
_GAP_S = 0.5
"""A line is broken where nothing came for so long, and for ten times what is usual [s]."""
_WALL_FROM, _WALL_TO = 0.05, 0.6
"""Solids between these heights are in the way of a robot, and drawn from above [m]."""


_CENTRED: dict[str, Any] = {"ha": "center", "va": "center"}
_TRAILS: tuple[tuple[str, str, str, Any], ...] = (
    ("odometry", "odometry", "odometry alone", (0, (1, 1.2))),
    ("estimate", "belief", "belief", "-"),
)
"""Kind of a trail, its colour, its name, how its line is drawn."""


def trajectory(told: Told, moments: list[Moment], size: tuple[float, float] = (WIDTH, 5.2)) -> str:
    """Return the floor from above: map or solids, plans, where robots were and believed to be, as SVG.

    Args:
        told: The run.
        moments: That are marked, by their numbers.
        size: Of the picture [inches].
    """
    with figure(size) as drawn:
        axes = drawn.add_subplot()
        axes.set_aspect("equal", adjustable="datalim")
        _floor(axes, told)
        for number, plan in enumerate(told.plans[-30:]):
            label = "plan" if number == 0 else None
            axes.plot(*plan.T, color=ROLES["plan"], lw=1.1, ls=(0, (4, 2)), label=label, zorder=3)
        several = len(told.robots) > 1
        for robot in told.robots:
            name = f" {robot}" if several else ""
            _, truth = told.truth(robot)
            axes.plot(
                *_thinned(truth).T, color=ROLES["truth"], lw=3.2, alpha=0.75, label=f"truth{name}", zorder=4
            )
            for kind, role, text, style in _TRAILS:
                line = _thinned(told.trail(robot, kind))
                if len(line):
                    axes.plot(*line.T, color=ROLES[role], lw=1.3, ls=style, label=f"{text}{name}", zorder=5)
            ink: dict[str, Any] = {"color": ROLES["ink"], "mfc": ROLES["paper"], "ms": 7, "mew": 1.6}
            for point, mark, text in ((truth[:1], "o", "start"), (truth[-1:], "s", "end")):
                if len(point):
                    axes.plot(*point.T, mark, **ink, zorder=6, label=None if several else text)
        for robot in told.robots[:1]:
            times, truth = told.truth(robot)
            for number, moment in enumerate(moments if len(times) else [], 1):
                at = truth[min(len(truth) - 1, int(np.searchsorted(times, moment.time_s)))]
                _mark(axes, at, number, moment)
        axes.set(xlabel="x [m]", ylabel="y [m]")
        axes.grid(visible=True, color=ROLES["line"], lw=0.5, zorder=0)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=6, frameon=False, fontsize=8.5)
        return svg(drawn, f"The floor from above, with the paths of {', '.join(told.robots) or 'nobody'}")


def time_series(told: Told, moments: list[Moment]) -> str:
    """Return states of the mission, speeds, errors and joints over time, as SVG."""
    panels = list(_panels(told))
    rows = ([0.45] if told.states else []) + [1.0] * len(panels)
    if not rows:
        return ""
    with figure((WIDTH, 0.6 + 1.35 * sum(rows))) as drawn:
        grid = drawn.subplots(len(rows), 1, sharex=True, squeeze=False, height_ratios=rows)[:, 0]
        if told.states:
            _timeline(grid[0], told)
        for axes, (title, lines) in zip(grid[1 if told.states else 0 :], panels, strict=True):
            for name, role, series in lines:
                times, values = _thinned_series(series)
                axes.plot(times, values, color=ROLES[role], lw=1.1, label=name)
            is_full = len(lines) > 3  # then the names have a line of their own, below the title
            axes.set_title(title, loc="left", fontsize=9, color=ROLES["ink"], pad=18 if is_full else None)
            axes.grid(visible=True, color=ROLES["line"], lw=0.5)
            if len(lines) > 1:
                axes.legend(
                    loc="lower left" if is_full else "lower right",
                    bbox_to_anchor=(0.0 if is_full else 1.0, 0.98),
                    ncols=8,
                    frameon=False,
                    fontsize=8,
                    borderaxespad=0.1,
                    handlelength=1.2,
                    columnspacing=1.2,
                )
        for number, moment in enumerate(moments, 1):
            role = "bad" if moment.bad else "muted"
            for axes in grid:
                axes.axvline(moment.time_s, color=ROLES[role], lw=0.8, ls=":")
            grid[0].annotate(
                str(number),
                (moment.time_s, 1.0),
                (0, 6),
                xycoords=("data", "axes fraction"),
                textcoords="offset points",
                ha="center",
                fontsize=8,
                color=ROLES[role],
                annotation_clip=False,
            )
        grid[-1].set_xlim(0.0, max(told.end_s, 1e-3))
        grid[-1].set_xlabel("simulated time [s]")
        return svg(drawn, "States of the mission, speeds and errors over time")


def _panels(told: Told) -> Iterator[tuple[str, list[tuple[str, str, Series]]]]:
    several = len(told.robots) > 1
    roles = {"commanded": "belief", "measured": "plan"}
    for axis, title in (("linear", "forward velocity [m/s]"), ("angular", "turning velocity [rad/s]")):
        for robot in told.robots:
            found = told.series(f"/velocity/{robot}/{axis}/")
            if found:
                name = f"{robot}: {title}" if several else title
                yield name, [(each.name, roles.get(each.name, "ink"), each) for each in found]
    for robot in told.robots:
        for each in told.series(f"/localisation/{robot}/"):
            is_yaw, whose = each.name == "yaw_error", f"{robot}: " if several else ""
            scale, unit = (180.0 / np.pi, "deg") if is_yaw else (1e3, "mm")
            name = f"{whose}localisation error, {'heading' if is_yaw else 'position'} [{unit}]"
            yield name, [("", "belief", each._replace(values=scale * each.values))]
    for robot in told.robots:
        joints = told.series(f"/joints/{robot}/")[:8]
        if joints:
            whose = f"{robot}: " if several else ""
            lines = [(j.name.removesuffix("_joint"), f"state{i}", j) for i, j in enumerate(joints)]
            yield f"{whose}joints [m] or [rad]", lines


def _timeline(axes: Axes, told: Told) -> None:
    """Draw the states of the mission as bars, each with its name if that fits."""
    colours: dict[str, str] = {}
    width = max(told.end_s, 1e-3)
    for start, end, name in told.states:
        role = colours.setdefault(name, f"state{len(colours) % 8}")
        look: dict[str, Any] = {"color": ROLES[role], "edgecolor": ROLES["paper"], "alpha": 0.45, "lw": 0.8}
        axes.barh(0.0, end - start, height=1.0, left=start, **look)
        fits = int(105 * (end - start) / width)
        if fits >= 4:
            text = name if len(name) <= fits else f"{name[: fits - 1]}…"
            middle = (start + end) / 2.0
            axes.text(middle, 0.0, text, fontsize=8, color=ROLES["ink"], clip_on=True, **_CENTRED)
    axes.set(ylim=(-0.5, 0.5), yticks=[])
    axes.tick_params(bottom=False)
    axes.set_title("mission", loc="left", fontsize=9, color=ROLES["ink"], pad=14)
    axes.spines[:].set_visible(False)


def _floor(axes: Axes, told: Told) -> None:
    """Draw the last map, or what stood in the way at the end."""
    if told.map is not None:
        cells = told.map.cells
        image = np.zeros((*cells.shape, 4), dtype=np.uint8)
        image[..., :3] = 128
        image[..., 3] = np.where(cells == 255, 40, np.where(cells >= 65, 235, 0))
        axes.imshow(image, origin="lower", extent=told.map.extent, interpolation="nearest", zorder=1)
        return
    if told.scene is None:
        return
    for solid in told.scene.solids(round(told.end_s * 1e9)):
        shape = solid.geometry
        if isinstance(shape, Box):
            half = np.array(shape.size) / 2.0
            corners = half * [(x, y, z) for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        elif isinstance(shape, Cylinder | Sphere):
            turn = np.linspace(0.0, 2.0 * np.pi, 24)
            height = getattr(shape, "length", 2.0 * shape.radius) / 2.0
            ring = shape.radius * np.stack((np.cos(turn), np.sin(turn)), axis=1)
            corners = np.vstack([np.column_stack((ring, np.full(24, z))) for z in (-height, height)])
        else:
            continue
        points = corners @ matrix_from_quat_wxyz(solid.pose.quat_wxyz).T + solid.pose.xyz
        if points[:, 2].min() < _WALL_TO and points[:, 2].max() > _WALL_FROM:
            look: dict[str, Any] = {"fc": ROLES["solid"], "ec": ROLES["wall"], "lw": 0.5, "alpha": 0.5}
            axes.add_patch(Polygon(_hull(points[:, :2]), closed=True, zorder=1, **look))


def _hull(points: Array) -> Array:
    from scipy.spatial import ConvexHull

    return np.asarray(points[ConvexHull(points).vertices])


def _mark(axes: Axes, at: Array, number: int, moment: Moment) -> None:
    colour = ROLES["bad" if moment.bad else "ink"]
    axes.annotate(
        str(number),
        (at[0], at[1]),
        (11, 11),
        textcoords="offset points",
        fontsize=8.5,
        zorder=8,
        color=colour,
        **_CENTRED,
        bbox={"boxstyle": "circle,pad=0.25", "fc": ROLES["paper"], "ec": colour, "lw": 1.1},
        arrowprops={"arrowstyle": "-", "color": colour, "lw": 0.9, "shrinkA": 0, "shrinkB": 0},
    )


def _thinned(line: Array) -> Array:
    """Return a line of fewer points."""
    return line if len(line) <= _POINTS else line[np.linspace(0, len(line) - 1, _POINTS).astype(int)]


def _thinned_series(series: Series) -> tuple[Array, Array]:
    """Return a series of fewer points, which keeps the least and the largest of each stretch, and gaps."""
    times, values = series.times_s, series.values
    steps = np.diff(times)
    usual = float(np.median(steps)) if len(steps) else 0.0
    gaps = times[1:][steps > max(_GAP_S, 10.0 * usual)]
    if len(times) > _POINTS:
        stretches = np.array_split(np.arange(len(times)), _POINTS // 2)
        ends = ((at[np.argmin(values[at])], at[np.argmax(values[at])]) for at in stretches)
        kept = sorted({int(i) for pair in ends for i in pair})
        times, values = times[kept], values[kept]
    at_gaps = np.searchsorted(times, gaps)
    return np.insert(times, at_gaps, np.nan), np.insert(values, at_gaps, np.nan)
