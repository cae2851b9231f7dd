"""A stop or a release that is said again until it is acknowledged: no one message matters."""

from __future__ import annotations

from twin.nodes.guard.status import Acknowledgement
from twin.nodes.guard.verdict import Verdict

AGAIN_NS = 50_000_000
"""Until it is said again."""


class Request:
    """One stop or release, without topics and clocks; times are by the sender's clock [ns]."""

    def __init__(self, kind: str, stamp_ns: int, by: str, *, until_ns: int | None = None) -> None:
        """Be due.

        Args:
            kind: 'stop' or 'release'.
            stamp_ns: By which its acknowledgement is known.
            by: Who asks.
            until_ns: It is given up then; None: never.
        """
        self.kind, self.stamp_ns, self.by = kind, stamp_ns, by
        self.verdict: Verdict | None = None
        """What the guard said; None: nothing yet."""
        self._until_ns = until_ns
        self._due_ns: int | None = None

    @property
    def is_accepted(self) -> bool:
        """Whether the guard did it."""
        return self.verdict is Verdict.ACCEPTED

    def is_over(self, now_ns: int) -> bool:
        """Whether it need not be said again: it is acknowledged, or given up."""
        return self.verdict is not None or (self._until_ns is not None and now_ns >= self._until_ns)

    def say(self, now_ns: int) -> bool:
        """Return whether it is to be said now; then it is due again later."""
        if self.is_over(now_ns) or (self._due_ns is not None and now_ns < self._due_ns):
            return False
        self._due_ns = now_ns + AGAIN_NS
        return True

    def hear(self, said: Acknowledgement) -> None:
        """Take in an acknowledgement, perhaps that of another one."""
        if (said.kind, said.stamp_ns, said.by) == (self.kind, self.stamp_ns, self.by):
            self.verdict = said.verdict
