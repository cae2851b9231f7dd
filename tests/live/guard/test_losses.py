"""A stop and a release at both ends of a link that loses messages."""

from __future__ import annotations

from collections.abc import Collection
from itertools import combinations

import pytest

from twin.live.guard.gate import STILL, Gate, GateConfig, Lane
from twin.live.guard.request import Request
from twin.nodes.guard.status import Acknowledgement
from twin.nodes.guard.verdict import Verdict

MS = 1_000_000
STOP_MS, RELEASE_MS, END_MS = 100, 400, 800


class Story:
    """A robot drives, is stopped, and is released; in steps of 5 ms, each message takes one of them."""

    def __init__(self, lost: Collection[int] = ()) -> None:
        self.gate = Gate(GateConfig())
        self.gate.release(None, 0)
        self.lost = lost
        self.count = 0
        self.velocity = STILL
        """What the robot heard last."""
        self.moved: list[int] = []
        """When it was told to move [ms]."""
        self.seen_ns = 0
        self.requests: list[Request] = []
        for at_ms in range(0, END_MS, 5):
            self.step(at_ms, at_ms * MS)

    def arrives(self) -> bool:
        self.count += 1
        return self.count - 1 not in self.lost

    def step(self, at_ms: int, now_ns: int) -> None:
        gate = self.gate
        if at_ms == STOP_MS:
            self.requests.append(Request("stop", 7, "me"))
        if at_ms == RELEASE_MS:
            self.requests.append(Request("release", self.seen_ns, "me", until_ns=now_ns + 2_000 * MS))
        for request in self.requests:
            if request.say(now_ns) and self.arrives():
                if request.kind == "stop":
                    gate.stop(request.by, now_ns)
                    verdict = Verdict.ACCEPTED
                else:
                    released = gate.release(request.stamp_ns, now_ns)
                    verdict = Verdict.ACCEPTED if released else Verdict.OLD
                if self.arrives():
                    said = Acknowledgement(
                        kind=request.kind,
                        stamp_ns=request.stamp_ns,
                        by=request.by,
                        verdict=verdict,
                        seen_ns=now_ns,
                    )
                    request.hear(said)
        if at_ms % 50 == 0 and self.arrives():
            gate.command(Lane.AUTONOMY, "a", now_ns + 1, (0.3, 0, 0, 0, 0, 0), now_ns)
        if at_ms % 100 == 0:
            gate.told(now_ns + 1, now_ns)
            if self.arrives():
                self.seen_ns = now_ns + 1
        if at_ms % 20 == 0 and self.arrives():
            self.velocity = gate.output(now_ns)
        if self.velocity != STILL:
            self.moved.append(at_ms)


def test_without_losses() -> None:
    story = Story()
    assert all(request.is_accepted for request in story.requests)
    assert max(at_ms for at_ms in story.moved if at_ms < RELEASE_MS) < STOP_MS + 20
    assert min(at_ms for at_ms in story.moved if at_ms > RELEASE_MS) < RELEASE_MS + 100


@pytest.mark.parametrize("most_lost", [1, 2])
def test_no_message_matters(most_lost: int) -> None:
    """Each loss, and each pair of losses: it is stopped a little later, not less, and released as well."""
    count = Story().count
    assert count > 60
    for lost in combinations(range(count), most_lost):
        story = Story(lost)
        stopped = [at_ms for at_ms in story.moved if STOP_MS <= at_ms < RELEASE_MS]
        assert max(stopped, default=0) < STOP_MS + 20 + 50 * most_lost, lost
        assert story.moved[-1] > RELEASE_MS, lost
        assert all(request.is_accepted for request in story.requests), lost


def test_a_stop_is_said_until_it_is_heard_and_a_release_for_a_while() -> None:
    stop, release = Request("stop", 1, "me"), Request("release", 1, "me", until_ns=2_000 * MS)
    said = {"stop": 0, "release": 0}
    for now_ns in range(0, 60_000 * MS, 10 * MS):
        for request in (stop, release):
            said[request.kind] += request.say(now_ns)
    assert said == {"stop": 1200, "release": 40}
    of_another = Acknowledgement(kind="stop", stamp_ns=2, by="me", verdict=Verdict.ACCEPTED, seen_ns=1)
    stop.hear(of_another)
    assert not stop.is_over(0)
