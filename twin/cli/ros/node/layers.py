"""Layers of a directed graph: which vertex stands in which column, and in which order, for few crossings.

Sugiyama's method; the edges that close a cycle by the heuristic of Eades, Lin and Smyth (1993).
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

Edge = tuple[int, int]
"""Numbers of two vertices."""

_SWEEPS = 12


def feedback(count: int, edges: Sequence[Edge]) -> frozenset[Edge]:
    """Return few edges without which there is no cycle."""
    out = [{b for a, b in edges if a == v} for v in range(count)]
    into = [{a for a, b in edges if b == v} for v in range(count)]
    left = set(range(count))
    head: list[int] = []
    tail: list[int] = []
    while left:
        sinks = sorted(v for v in left if not out[v] & left)
        sources = sorted(v for v in left if not into[v] & left)
        if sinks:
            tail.append(sinks[0])
            left.remove(sinks[0])
        elif sources:
            head.append(sources[0])
            left.remove(sources[0])
        else:
            best = max(sorted(left), key=lambda v: len(out[v] & left) - len(into[v] & left))
            head.append(best)
            left.remove(best)
    rank = {v: i for i, v in enumerate([*head, *reversed(tail)])}
    return frozenset((a, b) for a, b in edges if rank[a] > rank[b])


def layers(count: int, edges: Sequence[Edge]) -> list[int]:
    """Return each vertex's layer: right of all that lead to it, and as near to its neighbours as possible."""
    out = [[b for a, b in edges if a == v] for v in range(count)]
    into = [[a for a, b in edges if b == v] for v in range(count)]
    layer = [0] * count
    for _ in range(count):
        longest = [max((layer[a] + 1 for a in into[v]), default=0) for v in range(count)]
        if longest == layer:
            break
        layer = longest
    for _ in range(count):
        before = list(layer)
        for v in reversed(range(count)):
            lowest = max((layer[a] + 1 for a in into[v]), default=0)
            highest = min((layer[b] - 1 for b in out[v]), default=layer[v])
            layer[v] = highest if len(out[v]) > len(into[v]) else lowest if into[v] else layer[v]
        if layer == before:
            break
    lowest = min(layer, default=0)
    return [each - lowest for each in layer]


def chains(count: int, edges: Sequence[Edge], layers: Sequence[int]) -> tuple[dict[Edge, list[int]], int]:
    """Return each edge as a chain of vertices, new ones in the layers between, and how many there are now."""
    chains: dict[Edge, list[int]] = {}
    for a, b in edges:
        between = layers[b] - layers[a] - 1
        chains[a, b] = [a, *range(count, count + between), b]
        count += between
    return chains, count


def ordered(column: Sequence[int], links: Sequence[Edge]) -> list[list[int]]:
    """Return the vertices of each column from top to bottom, with few crossings."""
    columns: list[list[int]] = [[] for _ in range(max(column, default=-1) + 1)]
    for v, place in enumerate(column):
        columns[place].append(v)
    before: dict[int, list[int]] = {v: [] for v in range(len(column))}
    after: dict[int, list[int]] = {v: [] for v in range(len(column))}
    for a, b in links:
        after[a].append(b)
        before[b].append(a)
    best, fewest = [list(each) for each in columns], crossings(columns, after)
    for sweep in range(_SWEEPS):
        down = sweep % 2 == 0
        indices = range(1, len(columns)) if down else range(len(columns) - 2, -1, -1)
        for i in indices:
            _sort_column(columns[i], columns[i - 1 if down else i + 1], before if down else after)
        _swap_neighbours(columns, before, after)
        now = crossings(columns, after)
        if now < fewest:
            best, fewest = [list(each) for each in columns], now
    return best


def _sort_column(column: list[int], beside: Sequence[int], neighbours: Mapping[int, list[int]]) -> None:
    """Sort by the mean place of neighbours in the column beside."""
    place = {v: i for i, v in enumerate(beside)}
    keys = {}
    for i, v in enumerate(column):
        places = [place[n] for n in neighbours[v]]
        keys[v] = sum(places) / len(places) if places else i * len(beside) / max(1, len(column))
    column.sort(key=lambda v: keys[v])


def _swap_neighbours(
    columns: list[list[int]], before: Mapping[int, list[int]], after: Mapping[int, list[int]]
) -> None:
    """Exchange vertices that are one above the other as long as that saves crossings."""
    for _ in range(4):
        improved = False
        for i, column in enumerate(columns):
            left = {v: n for n, v in enumerate(columns[i - 1])} if i else {}
            right = {v: n for n, v in enumerate(columns[i + 1])} if i + 1 < len(columns) else {}
            for upper in range(len(column) - 1):
                a, b = column[upper], column[upper + 1]
                gain = 0
                for sides, place in ((before, left), (after, right)):
                    pa, pb = [place[n] for n in sides[a]], [place[n] for n in sides[b]]
                    gain += sum((x > y) - (x < y) for x in pa for y in pb)
                if gain > 0:
                    column[upper], column[upper + 1] = b, a
                    improved = True
        if not improved:
            return


def crossings(columns: Sequence[Sequence[int]], after: Mapping[int, Sequence[int]]) -> int:
    """Return how many pairs of links cross."""
    total = 0
    for column, beside in itertools.pairwise(columns):
        place = {v: i for i, v in enumerate(beside)}
        ends = [sorted(place[n] for n in after[v]) for v in column]
        for i, upper in enumerate(ends):
            total += sum(x > y for lower in ends[i + 1 :] for x in upper for y in lower)
    return total
