"""What is known of one frame over time: tf2's TimeCache and StaticCache."""

from __future__ import annotations

from bisect import bisect_left, bisect_right

from twin.bridge.tf.rigid import Rigid, interpolate

UNKNOWN_AUTHORITY = "unknown_publisher"
"""tf2's word for a broadcaster that nobody named."""


class FrameCache:
    """T_parent_child of one child frame over time, sorted by stamp; a static one has a single sample."""

    __slots__ = ("authority", "child", "parent", "parents", "stamps", "static", "values")

    def __init__(self, child: str, static: bool) -> None:
        self.child = child
        self.static = static
        self.authority: object = UNKNOWN_AUTHORITY
        """Who broadcast last; its `str` is the name."""
        self.parent = ""
        """Of the latest sample."""
        self.stamps: list[int] = []
        """[ns], rising."""
        self.values: list[Rigid] = []
        self.parents: list[str] = []
        """Of each sample: a frame may be given another parent as time goes on."""

    def insert(self, time_ns: int, parent: str, value: Rigid, cache_ns: int) -> bool:
        """Store a sample; return False if it is older than the cache, or its stamp is there already.

        Of two samples with one stamp the first is kept, as by tf2 0.7; ROS 2's keeps both, and finds the
        second.
        """
        if self.static:
            self.stamps, self.values, self.parents, self.parent = [time_ns], [value], [parent], parent
            return True
        stamps = self.stamps
        if not stamps or time_ns > stamps[-1]:
            stamps.append(time_ns)
            self.values.append(value)
            self.parents.append(parent)
            self.parent = parent
            if stamps[0] < time_ns - cache_ns:
                outdated = 1  # mostly
                while stamps[outdated] < time_ns - cache_ns:
                    outdated += 1
                del stamps[:outdated], self.values[:outdated], self.parents[:outdated]
            return True
        index = bisect_left(stamps, time_ns)
        if stamps[index] == time_ns or time_ns < stamps[-1] - cache_ns:
            return False
        stamps.insert(index, time_ns)
        self.values.insert(index, value)
        self.parents.insert(index, parent)
        return True

    def clear(self) -> None:
        """Forget the samples, as tf2 does: not those of a static frame."""
        if not self.static:
            self.stamps, self.values, self.parents = [], [], []

    @property
    def has_one_parent(self) -> bool:
        """Whether all samples have the same parent."""
        return bool(self.parents) and self.parents.count(self.parent) == len(self.parents)

    def value(self, time_ns: int) -> Rigid | None:
        """Return T_parent_child at a time [ns], 0 the latest; None if it was not published for that time."""
        if self.static:
            return self.values[0]
        stamps = self.stamps
        if not stamps:
            return None
        if time_ns == stamps[-1] or time_ns == 0:
            return self.values[-1]
        after = bisect_right(stamps, time_ns)
        if after == 0:
            return None
        before = after - 1
        start = stamps[before]
        if start == time_ns:
            return self.values[before]
        if after == len(stamps):
            return None
        if self.parents[before] != self.parents[after]:
            return self.values[before]
        ratio = (time_ns - start) / (stamps[after] - start)
        return interpolate(self.values[before], self.values[after], ratio)

    def parent_at(self, time_ns: int) -> str:
        """Return the parent at a time [ns] for which there is a value: that of the sample before."""
        if time_ns == 0 or self.static:
            return self.parent
        return self.parents[bisect_right(self.stamps, time_ns) - 1]
