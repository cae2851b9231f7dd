"""A layered drawing of a directed graph, from left to right, in which no edge crosses a label.

Sugiyama's method: edges that close a cycle are turned round, every vertex gets a layer, an edge over several
layers gets a place of its own in each of them, layers are ordered for few crossings, and heights are chosen
so that edges are straight where they can be. (Sugiyama, Tagawa, Toda, 1981; Eades, Lin, Smyth, 1993.)
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from twin.cli.ros.node.layers import Edge, chains, feedback, layers, ordered

Size = tuple[float, float]
"""Width and height [px]."""

GAP_X, GAP_Y, LINE_GAP = 70.0, 16.0, 12.0
"""Between layers, between vertices of a layer, and between edges that pass a layer [px]."""
_BALANCE, _STRAIGHTEN = 40, 4


@dataclass(frozen=True, kw_only=True)
class Point:
    """Where an edge passes a layer: straight from x0 to x1 [px]."""

    x0: float
    x1: float
    y: float


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Places of vertices, by number [px]; x and y are their middles."""

    places: tuple[tuple[float, float], ...]
    paths: Mapping[Edge, tuple[Point, ...]]
    """Of each edge, in its own direction: the layers that it passes, its ends included."""
    turned: frozenset[Edge]
    """Edges that run from right to left, because they close a cycle."""
    width: float
    height: float


def lay_out(sizes: Sequence[Size], edges: Sequence[Edge]) -> Layout:
    """Place vertices of these sizes; edges are pairs of different vertices, each at most once."""
    turned = feedback(len(sizes), edges)
    forward = sorted({(b, a) if (a, b) in turned else (a, b) for a, b in edges})
    layer = layers(len(sizes), forward)
    chain_of, count = chains(len(sizes), forward, layer)
    links = [pair for chain in chain_of.values() for pair in itertools.pairwise(chain)]
    column = layer + [0] * (count - len(sizes))
    for chain in chain_of.values():
        for step, vertex in enumerate(chain):
            column[vertex] = column[chain[0]] + step
    columns = ordered(column, links)
    heights = [size[1] for size in sizes] + [0.0] * (count - len(sizes))
    gaps = _gaps(columns, heights, real=len(sizes))
    ys = _balanced(columns, links, gaps, real=len(sizes), count=count)
    _straighten(ys, columns, gaps, list(chain_of.values()))
    top = min((ys[v] - heights[v] / 2.0 for v in range(count)), default=0.0)
    return _placed(sizes, edges, turned, columns, chain_of, [y - top for y in ys])


def _gaps(columns: Sequence[Sequence[int]], heights: Sequence[float], *, real: int) -> list[list[float]]:
    """Return how far apart the middles of neighbours in each column must be."""
    return [
        [
            (heights[a] + heights[b]) / 2.0 + (GAP_Y if a < real and b < real else LINE_GAP)
            for a, b in itertools.pairwise(column)
        ]
        for column in columns
    ]


def _balanced(
    columns: Sequence[Sequence[int]],
    links: Sequence[Edge],
    gaps: Sequence[Sequence[float]],
    *,
    real: int,
    count: int,
) -> list[float]:
    """Return the middle of each vertex: near its neighbours, apart from what is above and below it."""
    near: dict[int, list[tuple[int, float]]] = {v: [] for v in range(count)}
    for a, b in links:
        weight = 1.0 + 3.0 * ((a >= real) + (b >= real))
        near[a].append((b, weight))
        near[b].append((a, weight))
    ys = [0.0] * count
    for column, gap in zip(columns, gaps, strict=True):
        for i, v in enumerate(column):
            ys[v] = sum(gap[:i]) - sum(gap) / 2.0
    for sweep in range(_BALANCE):
        for i in range(len(columns)) if sweep % 2 == 0 else reversed(range(len(columns))):
            column = columns[i]
            wanted = [_mean(near[v], ys, ys[v]) for v in column]
            weights = [sum(weight for _, weight in near[v]) or 0.1 for v in column]
            for v, y in zip(column, _apart(wanted, weights, gaps[i]), strict=True):
                ys[v] = y
    return ys


def _straighten(
    ys: list[float],
    columns: Sequence[Sequence[int]],
    gaps: Sequence[Sequence[float]],
    chains: Sequence[Sequence[int]],
) -> None:
    """Let edges over several layers bend as rarely as their neighbours allow."""
    above: dict[int, tuple[int, float]] = {}
    below: dict[int, tuple[int, float]] = {}
    for column, gap in zip(columns, gaps, strict=True):
        for (a, b), distance in zip(itertools.pairwise(column), gap, strict=True):
            below[a], above[b] = (b, distance), (a, distance)

    def free(v: int) -> tuple[float, float]:
        low = ys[above[v][0]] + above[v][1] if v in above else -math.inf
        high = ys[below[v][0]] - below[v][1] if v in below else math.inf
        return low, high

    for _ in range(_STRAIGHTEN):
        for chain in sorted(chains, key=len, reverse=True):
            inner = list(chain[1:-1])
            target = ys[chain[-1]]
            while inner:  # from the right: as many as can have one height
                low, high, many = -math.inf, math.inf, 0
                for v in reversed(inner):
                    lower, upper = free(v)
                    if max(low, lower) > min(high, upper):
                        break
                    low, high, many = max(low, lower), min(high, upper), many + 1
                inner, run = inner[: -max(many, 1)], inner[len(inner) - many :]
                if not run:  # it has no room at all
                    continue
                # Without a step into the edge's beginning if it is as good.
                wanted = ys[chain[0]] if not inner and low <= ys[chain[0]] <= high else target
                target = min(max(wanted, low), high)
                for v in run:
                    ys[v] = target


def _mean(neighbours: Sequence[tuple[int, float]], ys: Sequence[float], default: float) -> float:
    total = sum(weight for _, weight in neighbours)
    return sum(ys[n] * weight for n, weight in neighbours) / total if total else default


def _apart(wanted: Sequence[float], weights: Sequence[float], gaps: Sequence[float]) -> list[float]:
    """Return the values nearest to the wanted ones that keep their gaps: pooled where they are too close."""
    offsets = [0.0]
    for gap in gaps:
        offsets.append(offsets[-1] + gap)
    blocks: list[list[float]] = []  # value, weight, how many
    for value, weight, offset in zip(wanted, weights, offsets, strict=False):
        blocks.append([value - offset, weight, 1.0])
        while len(blocks) > 1 and blocks[-2][0] > blocks[-1][0]:
            (v1, w1, n1), (v2, w2, n2) = blocks[-2:]
            blocks[-2:] = [[(v1 * w1 + v2 * w2) / (w1 + w2), w1 + w2, n1 + n2]]
    values = [value for value, _, many in blocks for _ in range(int(many))]
    return [value + offset for value, offset in zip(values, offsets, strict=False)]


def _placed(
    sizes: Sequence[Size],
    edges: Sequence[Edge],
    turned: frozenset[Edge],
    columns: Sequence[Sequence[int]],
    chain_of: Mapping[Edge, Sequence[int]],
    ys: Sequence[float],
) -> Layout:
    """Give every column its place from left to right, and every edge its points."""
    span: dict[int, tuple[float, float]] = {}
    xs = [0.0] * len(sizes)
    left = 0.0
    for column in columns:
        width = max((sizes[v][0] for v in column if v < len(sizes)), default=0.0)
        for v in column:
            span[v] = (left, left + width)
            if v < len(sizes):
                xs[v] = left + width / 2.0
        left += width + GAP_X
    paths: dict[Edge, tuple[Point, ...]] = {}
    for a, b in edges:
        chain = list(chain_of[(b, a) if (a, b) in turned else (a, b)])
        points = []
        for v in chain:
            x0, x1 = span[v]
            if v < len(sizes):  # an edge begins at the right side of a label and ends at the left side of one
                half = sizes[v][0] / 2.0
                x0, x1 = (xs[v] + half, x1) if v == chain[0] else (x0, xs[v] - half)
            points.append(Point(x0=x0, x1=x1, y=ys[v]))
        if (a, b) in turned:
            points = [Point(x0=p.x1, x1=p.x0, y=p.y) for p in reversed(points)]
        paths[a, b] = tuple(points)
    bottom = max((ys[v] + sizes[v][1] / 2.0 for v in range(len(sizes))), default=0.0)
    return Layout(
        places=tuple((xs[v], ys[v]) for v in range(len(sizes))),
        paths=paths,
        turned=turned,
        width=max(0.0, left - GAP_X),
        height=max([bottom, *ys]) if ys else 0.0,
    )
