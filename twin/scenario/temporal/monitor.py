"""Judges a formula while its signals come in, with no more memory than its windows need."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from typing import NamedTuple

from twin.scenario.temporal import formula as stl
from twin.scenario.temporal.formula import FOREVER, Formula, Predicate, Value, Window
from twin.scenario.temporal.margins import UNKNOWN, Margin, lowest


class Segment(NamedTuple):
    """A margin over a span of time."""

    begin: int
    """[ns]"""
    end: int
    """Not in it any more [ns]."""
    margin: Margin


class _Node(ABC):
    """The margin of a part of the formula at each moment at which the whole one asks for it."""

    def __init__(self, asked: Window) -> None:
        self.asked = asked
        self.ready: deque[Segment] = deque()
        """What is known and not taken yet: unbroken, from the first moment asked for."""

    def _found(self, begin: int, end: int, margin: Margin) -> None:
        """Add what is known of a span, as far as somebody asks."""
        begin, end = max(begin, self.asked.low), min(end, self.asked.high + 1)
        if begin >= end:
            return
        if self.ready and self.ready[-1].margin == margin:
            begin = self.ready.pop().begin
        self.ready.append(Segment(begin, end, margin))

    @abstractmethod
    def work(self) -> None:
        """Find what can be found of what the parts have ready."""

    def bounds(self) -> tuple[Margin, Margin]:
        """Return between which the margin lies, of a node of which a single moment is asked for."""
        return (self.ready[0].margin, self.ready[0].margin) if self.ready else self._so_far()

    def _so_far(self) -> tuple[Margin, Margin]:
        return UNKNOWN


class _Leaf(_Node):
    """A predicate."""

    def __init__(self, predicate: Predicate, index: int, asked: Window) -> None:
        super().__init__(asked)
        self.predicate, self._index = predicate, index
        self._margin: Margin | None = None
        self._known = 0

    def take(self, time_ns: int, value: Value) -> None:
        """Take a value that the signal has from a moment on."""
        self.know(time_ns)
        size = self.predicate.margin(value)
        if self._margin is None or self._margin.size != size:  # of equal ones the first is the worst moment
            self._margin = Margin(size, time_ns, self._index, value)

    def know(self, until_ns: int) -> None:
        """Note that the last value lasts at least up to, not including, a moment."""
        if self._margin is not None and until_ns > self._known:
            self._found(self._known, until_ns, self._margin)
            self._known = until_ns

    def work(self) -> None:
        """What is known is ready."""


class _Not(_Node):
    def __init__(self, part: _Node) -> None:
        super().__init__(part.asked)
        self._part = part

    def work(self) -> None:
        self._part.work()
        while self._part.ready:
            begin, end, margin = self._part.ready.popleft()
            self._found(begin, end, -margin)

    def _so_far(self) -> tuple[Margin, Margin]:
        low, high = self._part.bounds()
        return -high, -low


class _And(_Node):
    def __init__(self, parts: list[_Node]) -> None:
        super().__init__(parts[0].asked)
        self._parts = parts

    def work(self) -> None:
        for part in self._parts:
            part.work()
        for begin, end, margins in _aligned(self._parts):
            self._found(begin, end, lowest(margins))

    def _so_far(self) -> tuple[Margin, Margin]:
        bounds = [part.bounds() for part in self._parts]
        return lowest(low for low, _ in bounds), lowest(high for _, high in bounds)


class _Always(_Node):
    """The least margin of a window that slides: a monotonic queue, each segment enters and leaves once."""

    def __init__(self, part: _Node, window: Window, asked: Window) -> None:
        super().__init__(asked)
        self._part, self._window = part, window
        self._next = asked.low
        self._last_left = _plus(asked.high, window.low)
        self._least: deque[Segment] = deque()
        """For windows up to now: over which left ends which margin is the least; they grow."""

    def work(self) -> None:
        self._part.work()
        while self._part.ready:
            self._slide(self._part.ready.popleft())

    def _slide(self, new: Segment) -> None:
        least, low, high = self._least, self._window.low, self._window.high
        begin, end, margin = new
        while least and least[-1].margin.size > margin.size:
            begin = least.pop().begin
        if not least or least[-1].end <= self._last_left:
            least.append(Segment(begin, end, margin))
        known = FOREVER if end == FOREVER or end > self._part.asked.high else end - high
        while self._next < known:
            while least[0].end <= self._next + low:
                least.popleft()
            until = known if len(least) == 1 else min(known, least[0].end - low)
            self._found(self._next, until, least[0].margin)
            self._next = until

    def _so_far(self) -> tuple[Margin, Margin]:
        return UNKNOWN[0], self._least[0].margin if self._least else UNKNOWN[1]


class _Finally(_Node):
    """The margin at the end, at every moment."""

    def __init__(self, part: _Node, asked: Window) -> None:
        super().__init__(asked)
        self._part = part

    def work(self) -> None:
        self._part.work()
        while self._part.ready:
            _, end, margin = self._part.ready.popleft()
            if end == FOREVER:
                self._found(self.asked.low, FOREVER, margin)


class _Open(NamedTuple):
    """A span of moments at which an until is not decided."""

    begin: int
    end: int
    best: Margin
    """Of those at which `then` could have come so far."""
    first: Margin
    """The least of `first` from the moment to now."""


class _Until(_Node):
    """`first` until `then`, which must come within `span` [ns]."""

    def __init__(self, first: _Node, then: _Node, span: int, asked: Window) -> None:
        super().__init__(asked)
        self._first, self._then, self._span = first, then, span
        self._open: deque[_Open] = deque()

    def work(self) -> None:
        self._first.work()
        self._then.work()
        for begin, end, (first, then) in _aligned([self._first, self._then]):
            self._advance(begin, end, first, then)

    def _advance(self, begin: int, end: int, first: Margin, then: Margin) -> None:
        was, self._open = self._open, deque()
        for one in was:
            best = max(one.best, lowest((one.first, then)), key=_size)
            self._keep(_Open(one.begin, one.end, best, lowest((one.first, first))))
        if begin <= self.asked.high:
            self._keep(_Open(begin, min(end, self.asked.high + 1), then, first))
        over = FOREVER if end == FOREVER or end > self._then.asked.high else end - self._span
        while self._open and self._open[0].begin < over:
            one = self._open.popleft()
            self._found(one.begin, min(one.end, over), one.best)
            if one.end > over:
                self._open.appendleft(one._replace(begin=over))

    def _keep(self, one: _Open) -> None:
        last = self._open[-1] if self._open else None
        if last and (last.best.size, last.first.size) == (one.best.size, one.first.size):
            one = self._open.pop()._replace(end=one.end)
        self._open.append(one)

    def _so_far(self) -> tuple[Margin, Margin]:
        if not self._open:
            return UNKNOWN
        one = self._open[0]
        return one.best, max(one.best, one.first, key=_size)


class Monitor:
    """Takes the values of a formula's signals in the order of time, and tells how it stands with the formula.

    Memory is that of the windows: of an operator without an end that is inside of another it grows with the
    changes of its signals.
    """

    def __init__(self, formula: Formula) -> None:
        self.formula = formula
        self.predicates: list[Predicate] = []
        """What `Margin.predicate` counts."""
        self._leaves: dict[str, list[_Leaf]] = {}
        self._root = self._made(formula, Window(0, 0))
        self.bounds: tuple[Margin, Margin] = UNKNOWN
        """Between which the margin lies, whatever comes."""

    @property
    def signals(self) -> tuple[str, ...]:
        """The signals that it looks at, in the order of its text."""
        return tuple(self._leaves)

    @property
    def verdict(self) -> bool | None:
        """Whether the formula holds, whatever comes; None: it is not decided."""
        low, high = self.bounds
        return True if low.holds else None if high.holds else False

    def take(self, signal: str, time_ns: int, value: Value) -> None:
        """Take a value that a signal has from a moment on; of several at one moment the last counts."""
        for leaf in self._leaves[signal]:
            leaf.take(time_ns, value)

    def know(self, until_ns: int) -> None:
        """Judge, all being known up to, not including, a moment."""
        if self.bounds[0].size == self.bounds[1].size:
            return
        for leaves in self._leaves.values():
            for leaf in leaves:
                leaf.know(until_ns)
        self._root.work()
        self.bounds = self._root.bounds()

    def finish(self) -> Margin | None:
        """Return the margin, the run being over; None if a signal never had a value."""
        self.know(FOREVER)
        low, high = self.bounds
        if low.size != high.size:
            return None
        return high if low.predicate < 0 else low

    def _made(self, formula: Formula, asked: Window) -> _Node:
        match formula:
            case Predicate(signal):
                if formula not in self.predicates:
                    self.predicates.append(formula)
                leaf = _Leaf(formula, self.predicates.index(formula), asked)
                self._leaves.setdefault(signal, []).append(leaf)
                return leaf
            case stl.Not(part):
                return _Not(self._made(part, asked))
            case stl.And(parts):
                return _And([self._made(part, asked) for part in parts])
            case stl.Always(part, window):
                return _Always(self._made(part, _later(asked, window)), window, asked)
            case stl.Finally(part):
                return _Finally(self._made(part, Window(asked.low, FOREVER)), asked)
            case stl.Until(first, then, window):
                return self._until(first, then, window, asked)

    def _until(self, first: Formula, then: Formula, window: Window, asked: Window) -> _Node:
        """Make an until of a window of two parts: `first` before the window, and an until at its begin."""
        low, high = window.low, window.high
        span = FOREVER if high == FOREVER else high - low
        inner = _later(asked, Window(low, low))
        reach = _later(inner, Window(0, span))
        made: _Node = _Until(self._made(first, reach), self._made(then, reach), span, inner)
        if not low:
            return made
        made = _Always(made, Window(low, low), asked)
        before = self._made(stl.Always(first, Window(0, low - 1)), asked)
        return _And([made, before])


def _aligned(nodes: list[_Node]) -> list[tuple[int, int, list[Margin]]]:
    """Take what all nodes have ready, cut where one of them changes."""
    cut = []
    while all(node.ready for node in nodes):
        begin = max(node.ready[0].begin for node in nodes)
        end = min(node.ready[0].end for node in nodes)
        cut.append((begin, end, [node.ready[0].margin for node in nodes]))
        for node in nodes:
            segment = node.ready.popleft()
            if segment.end > end:
                node.ready.appendleft(segment._replace(begin=end))
    return cut


def _later(asked: Window, window: Window) -> Window:
    """Return which moments are looked at, if a window is opened at each that is asked for."""
    return Window(asked.low + window.low, _plus(asked.high, window.high))


def _plus(one: int, other: int) -> int:
    return min(FOREVER, one + other)


def _size(margin: Margin) -> float:
    return margin.size
