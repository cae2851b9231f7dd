"""What the two grippers hold: an event where they do not agree."""

from __future__ import annotations

_PATIENCE_NS = 1_500_000_000
"""One closes, or sets down, a little later than the other."""


class Holding:
    """Compares whether the physical and the virtual robot hold something; times are of one clock [ns]."""

    def __init__(self) -> None:
        """Begin with both alike."""
        self.differ = False
        """Whether they have not agreed for a while."""
        self._since_ns: int | None = None

    def update(self, time_ns: int, *, physical: bool, virtual: str | None) -> str | None:
        """Return a sentence when they begin to differ, and when they agree again.

        Args:
            time_ns: Now.
            physical: Whether the physical gripper presses on something.
            virtual: What the virtual one holds; None: nothing.
        """
        if physical == (virtual is not None):
            self._since_ns, differed, self.differ = None, self.differ, False
            held = "nothing" if virtual is None else virtual
            return f"both grippers agree again: they hold {held}" if differed else None
        if self._since_ns is None:
            self._since_ns = time_ns
        if self.differ or time_ns - self._since_ns < _PATIENCE_NS:
            return None
        self.differ = True
        if virtual is None:
            return "the physical gripper holds something, the virtual one nothing"
        return f"the virtual gripper holds {virtual}, the physical one nothing"
