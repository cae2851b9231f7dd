"""Whether a command is new, told by its sender's stamps alone: no two computers' clocks agree.

A stamp is a command's identity: a sender's only grow. And what arrives later after its stamp than others of
this sender did was under way for longer, whatever the clocks show. The quickest one is what it is compared
with, as in NTP's clock filter (RFC 5905, section 10); clocks that drift apart are allowed for.
"""

from __future__ import annotations

from twin.nodes.guard.verdict import Verdict

_LARGEST_DRIFT = 500e-6
"""No two computers' clocks drift apart faster, as a share of time."""


class SenderStamps:
    """Remembers one sender."""

    def __init__(self, max_age_ns: int) -> None:
        """Refuse what was under way for so much longer [ns] than the quickest."""
        self._max_age_ns = max_age_ns
        self._newest_ns = 0
        self._quickest_ns: int | None = None
        """Arrival by our clock minus stamp."""
        self._since_ns = 0
        """When that was found."""

    def judge(self, stamp_ns: int, now_ns: int) -> Verdict:
        """Return what a command's stamp tells, and remember it.

        Args:
            stamp_ns: By the sender's clock [ns].
            now_ns: When it arrived, by a clock of ours that is never set [ns].
        """
        if stamp_ns <= 0:
            return Verdict.NOT_STAMPED
        if stamp_ns <= self._newest_ns:
            return Verdict.DUPLICATE if stamp_ns == self._newest_ns else Verdict.OUT_OF_ORDER
        self._newest_ns = stamp_ns
        delay_ns = now_ns - stamp_ns
        if self._quickest_ns is not None:
            expected_ns = self._quickest_ns + round(_LARGEST_DRIFT * (now_ns - self._since_ns))
            if delay_ns > expected_ns:
                return Verdict.OLD if delay_ns - expected_ns > self._max_age_ns else Verdict.ACCEPTED
        self._quickest_ns, self._since_ns = delay_ns, now_ns
        return Verdict.ACCEPTED
