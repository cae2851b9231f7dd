"""Judges a formula while its signals come in, with no more memory than its windows need."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from typing import NamedTuple

from twin.scenario.temporal import formula as stl
from twin.scenario.temporal.formula import FOREVER, Formula, Predicate, Value, Window
from twin.scenario.temporal.margins import SIZE, UNKNOWN, Margin, lowest

Change = tuple[int, Margin]
"""From when on [ns] there is which margin."""


class _Node(ABC):
    """The margin of a part of the formula at each moment at which the whole one asks for it."""

    def __init__(self, asked: Window) -> None:
        self.asked = asked
        self.changes: deque[Change] = deque()
        """What is found and not taken yet; the first one of all is at the first moment asked for."""
        self.known = 0
        """Up to, not including, when all changes are found [ns]."""
        self._last: Margin | None = None

    def _found(self, begin: int, margin: Margin) -> None:
        """Add what is found to be so from a moment on, if somebody asks."""
        if margin != self._last and begin <= self.asked.high:
            self._last = margin
            self.changes.append((begin, margin))

    @abstractmethod
    def work(self) -> None:
        """Find what can be found of what the parts have found."""

    def bounds(self) -> tuple[Margin, Margin]:
        """Return between which the margin lies, of a node of which a single moment is asked for."""
        return (self.changes[0][1], self.changes[0][1]) if self.changes else self._so_far()

    def _so_far(self) -> tuple[Margin, Margin]:
        return UNKNOWN


class _Leaf(_Node):
    """A predicate."""

    def __init__(self, predicate: Predicate, index: int, asked: Window) -> None:
        super().__init__(asked)
        self.predicate, self._index = predicate, index
        self._margin: Margin | None = None
        self._since = asked.low
        """Since when there is that margin, the first value being that of all times before, too."""
        self._is_new = False
        """Whether that is not found yet: another value may come at that moment, or before somebody asks."""

    def take(self, time_ns: int, value: Value) -> None:
        """Take a value that the signal has from a moment on."""
        self.know(time_ns)
        size = self.predicate.margin(value)
        if self._margin is None or self._margin.size != size:  # of equal ones the first is the worst moment
            if self._margin is not None:
                self._since = max(time_ns, self.asked.low)
            self._margin, self._is_new = Margin(size, time_ns, self._index, value), True

    def know(self, until_ns: int) -> None:
        """Note that the last value lasts at least up to, not including, a moment."""
        if self._margin is not None and until_ns > self.known:
            self.known = until_ns
            if self._is_new and until_ns > self._since:
                self._is_new = False
                self._found(self._since, self._margin)

    def work(self) -> None:
        """What is known is found."""


class _Not(_Node):
    def __init__(self, part: _Node) -> None:
        super().__init__(part.asked)
        self._part = part

    def work(self) -> None:
        part = self._part
        part.work()
        while part.changes:
            begin, margin = part.changes.popleft()
            self._found(begin, -margin)
        self.known = part.known

    def _so_far(self) -> tuple[Margin, Margin]:
        low, high = self._part.bounds()
        return -high, -low


class _And(_Node):
    def __init__(self, parts: list[_Node]) -> None:
        super().__init__(parts[0].asked)
        self._parts = parts
        self._now = [UNKNOWN[0]] * len(parts)

    def work(self) -> None:
        for part in self._parts:
            part.work()
        self.known = min([part.known for part in self._parts])
        while (begin := _take_next(self._parts, self._now, self.known)) < FOREVER:
            self._found(begin, lowest(self._now))

    def _so_far(self) -> tuple[Margin, Margin]:
        bounds = [part.bounds() for part in self._parts]
        return lowest(low for low, _ in bounds), lowest(high for _, high in bounds)


class _Always(_Node):
    """The least margin of a window that slides: a monotonic queue, each change enters and leaves once."""

    def __init__(self, part: _Node, window: Window, asked: Window) -> None:
        super().__init__(asked)
        self._part, self._window = part, window
        self._next = asked.low
        self._last_left = _plus(asked.high, window.low)
        self._least: deque[Change] = deque()
        """For windows up to now: from which left end on which margin is the least; they grow."""

    def work(self) -> None:
        part, least = self._part, self._least
        part.work()
        while part.changes:
            begin, margin = part.changes.popleft()
            if begin - self._window.high > self._next:
                self._slide(begin)
            while least and least[-1][1].size > margin.size:
                begin = least.pop()[0]
            if not least or begin <= self._last_left:
                least.append((begin, margin))
        self._slide(part.known)

    def _slide(self, until: int) -> None:
        """Find the margins of windows that end before a moment."""
        least, low = self._least, self._window.low
        self.known = FOREVER if _is_last(until, self._part) else until - self._window.high
        while self._next < self.known:
            while len(least) > 1 and least[1][0] <= self._next + low:
                least.popleft()
            self._found(self._next, least[0][1])
            self._next = self.known if len(least) == 1 else min(self.known, least[1][0] - low)

    def _so_far(self) -> tuple[Margin, Margin]:
        return UNKNOWN[0], self._least[0][1] if self._least else UNKNOWN[1]


class _Finally(_Node):
    """The margin at the end, at every moment."""

    def __init__(self, part: _Node, asked: Window) -> None:
        super().__init__(asked)
        self._part = part

    def work(self) -> None:
        part = self._part
        part.work()
        while len(part.changes) > 1:
            part.changes.popleft()
        if part.known == FOREVER:
            self.known = FOREVER
            self._found(self.asked.low, part.changes[0][1])


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
        self._parts, self._span = [first, then], span
        self._now = [UNKNOWN[0]] * 2
        self._met = UNKNOWN
        """The margins of the moments from `_next` on."""
        self._next = asked.low
        self._open: deque[_Open] = deque()

    def work(self) -> None:
        for part in self._parts:
            part.work()
        until = min([part.known for part in self._parts])
        while (begin := _take_next(self._parts, self._now, until)) < FOREVER:
            self._advance(begin)
            self._meet(*self._now)
        self._advance(until)

    def _meet(self, first: Margin, then: Margin) -> None:
        """Let open moments see the margins of the next one."""
        self._met = first, then
        was, self._open = self._open, deque()
        for one in was:
            best = max(one.best, lowest((one.first, then)), key=SIZE)
            self._keep(_Open(one.begin, one.end, best, lowest((one.first, first))))

    def _advance(self, until: int) -> None:
        """Let the margins last up to a moment, and find those of moments whose window ends before."""
        if self._next < until:
            if self._next <= self.asked.high:
                first, then = self._met
                self._keep(_Open(self._next, min(until, self.asked.high + 1), then, first))
            self._next = until
        self.known = over = FOREVER if _is_last(until, self._parts[1]) else until - self._span
        while self._open and self._open[0].begin < over:
            one = self._open.popleft()
            self._found(one.begin, one.best)
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
        return one.best, max(one.best, one.first, key=SIZE)


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
        self._every_leaf = [leaf for leaves in self._leaves.values() for leaf in leaves]
        self.bounds: tuple[Margin, Margin] = UNKNOWN
        """Between which the margin lies, whatever comes."""
        self._settled = False
        """Whether that is one."""

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
        if not self._settled:
            for leaf in self._leaves[signal]:
                leaf.take(time_ns, value)

    def know(self, until_ns: int) -> None:
        """Judge, all being known up to, not including, a moment."""
        if self._settled:
            return
        for leaf in self._every_leaf:
            leaf.know(until_ns)
        self._root.work()
        low, high = self.bounds = self._root.bounds()
        self._settled = low.size == high.size

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


def _take_next(nodes: list[_Node], now: list[Margin], known: int) -> int:
    """Take the next change into `now`; return its moment, FOREVER if not all nodes know of one."""
    begin = known
    for node in nodes:
        if node.changes and node.changes[0][0] < begin:
            begin = node.changes[0][0]
    if begin >= known:
        return FOREVER
    for i, node in enumerate(nodes):
        if node.changes and node.changes[0][0] == begin:
            now[i] = node.changes.popleft()[1]
    return begin


def _is_last(until: int, part: _Node) -> bool:
    """Whether nobody asks for a part's margin after a moment."""
    return until == FOREVER or until > part.asked.high


def _later(asked: Window, window: Window) -> Window:
    """Return which moments are looked at, if a window is opened at each that is asked for."""
    return Window(asked.low + window.low, _plus(asked.high, window.high))


def _plus(one: int, other: int) -> int:
    return min(FOREVER, one + other)
