"""One picture of all trajectories, as SVG: a tile for each world."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby

from twin_benchmarks.barn.referee import Trial
from twin_benchmarks.barn.worlds import BarnSet, BarnWorld

_X, _Y = (-4.8, 0.3), (-0.1, 13.6)
"""What a tile shows of a world [m]."""
_TILE = (6.0, 15.2)
"""Of a tile with its caption [m]."""
_PIXELS_PER_M = 22.0
_COLOURS = {"success": "#1a7f37", "collision": "#cf222e", "timeout": "#bf8700"}


def svg(rules: BarnSet, trials: Sequence[Trial]) -> str:
    """Return the picture; trials of one world share its tile."""
    worlds = {world.id: world for world in rules.worlds}
    tiles = [
        (worlds[number], list(group))
        for number, group in groupby(sorted(trials, key=lambda t: t.world), key=lambda t: t.world)
    ]
    columns = max(1, min(len(tiles), math.ceil(math.sqrt(2.4 * len(tiles)))))
    rows = max(1, math.ceil(len(tiles) / columns))
    width, height = columns * _TILE[0], rows * _TILE[1]
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" '
        f'width="{width * _PIXELS_PER_M:.0f}" height="{height * _PIXELS_PER_M:.0f}" '
        'font-family="sans-serif" font-size="0.62">',
        f'<rect width="{width:g}" height="{height:g}" fill="#ffffff"/>',
    ]
    for index, (world, group) in enumerate(tiles):
        left = (index % columns) * _TILE[0] + 0.45
        top = (index // columns) * _TILE[1] + 1.2
        lines += [f'<g transform="translate({left:g} {top:g})">', *_tile(rules, world, group), "</g>"]
    return "\n".join([*lines, "</svg>", ""])


def _tile(rules: BarnSet, world: BarnWorld, trials: Sequence[Trial]) -> list[str]:
    score = sum(trial.score for trial in trials) / len(trials)
    worst = next((t.outcome for t in trials if t.outcome != "success"), "success")
    caption = f"{world.id}: {score:.3f}" + ("" if worst == "success" else f" {worst}")
    x, y = _at(rules.goal)
    lines = [
        f'<text x="0" y="-0.35" fill="{_COLOURS[worst]}">{caption}</text>',
        f'<rect width="{_X[1] - _X[0]:g}" height="{_Y[1] - _Y[0]:g}" fill="#f6f8fa"/>',
        f'<circle cx="{x:g}" cy="{y:g}" r="{rules.goal_radius:g}" fill="#dafbe1"/>',
        _line(world.path, "#b6bcc4", 0.06, "0.2 0.2"),
        f'<path d="{_dots(world)}" stroke="#57606a" stroke-width="{2.0 * rules.radius:g}" '
        'stroke-linecap="round"/>',
    ]
    lines += [_line(trial.trajectory, _COLOURS[trial.outcome], 0.11) for trial in trials]
    ends = [(t.trajectory[-1], t.outcome) for t in trials if t.trajectory and t.outcome != "success"]
    for point, outcome in ends:
        x, y = _at(point)
        lines.append(
            f'<circle cx="{x:g}" cy="{y:g}" r="0.3" fill="none" stroke="{_COLOURS[outcome]}" '
            'stroke-width="0.12"/>'
        )
    return lines


def _at(point: tuple[float, float]) -> tuple[float, float]:
    """Return where a point of the world is in a tile, north up."""
    return round(point[0] - _X[0], 3), round(_Y[1] - point[1], 3)


def _dots(world: BarnWorld) -> str:
    return "".join("M{:g} {:g}h0".format(*_at(centre)) for centre in world.obstacles)


def _line(points: Sequence[tuple[float, float]], colour: str, width: float, dashes: str = "") -> str:
    if not points:
        return ""
    text = " ".join("{:g},{:g}".format(*_at(point)) for point in points)
    dashed = f' stroke-dasharray="{dashes}"' if dashes else ""
    return f'<polyline points="{text}" fill="none" stroke="{colour}" stroke-width="{width:g}"{dashed}/>'
