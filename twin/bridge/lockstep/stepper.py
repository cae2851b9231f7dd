"""The run's side of lock-step: find the processes that take part, step them, and say who is late."""

from __future__ import annotations

import logging
import queue
import threading
import time
from collections.abc import Iterator
from typing import Any

import zenoh

from twin.bridge.bus import Bus
from twin.bridge.lockstep.mirror import Mirror
from twin.bridge.lockstep.protocol import (
    STEP,
    node_token,
    parse_node_token,
    requests,
    responses,
    run_token,
    step_key,
)
from twin.bridge.msgs import stamp
from twin.bridge.wire.keys import pack_attachment
from twin.bridge.wire.session import direct
from twin.errors import BridgeError

_log = logging.getLogger("twin.run")
_PATIENCE_S = 1.0
"""After so long, people are told what the run waits for."""
_POLL_S = 0.2
_MARGIN_S = 10.0
"""Zenoh gives up so much later than we do."""


class Attendance:
    """Which nodes of other processes want to be stepped, and whether they still are there."""

    def __init__(self, bus: Bus) -> None:
        self._lock = threading.Lock()
        self._present: set[tuple[str, str]] = set()
        self._changed = threading.Event()
        self.departures: dict[str, queue.SimpleQueue[Any]] = {}
        """Session -> where to say that it has gone."""
        liveliness, domain_id = bus.session.liveliness(), bus.domain_id
        self._declared: list[Any] = [
            liveliness.declare_token(run_token(domain_id)),
            liveliness.declare_subscriber(
                node_token(domain_id, "*", "*"), direct(self._on_change), history=True
            ),
        ]

    def sessions(self, node: str) -> list[str]:
        """Return the sessions that offer a node."""
        with self._lock:
            return sorted(session for session, name in self._present if name == node)

    @property
    def nodes(self) -> list[str]:
        """The full names of the nodes that are offered, sorted."""
        with self._lock:
            return sorted({name for _, name in self._present})

    def wait(self, timeout_s: float) -> None:
        """Wait for a change, at most so long [s] of wall time."""
        self._changed.wait(timeout_s)
        self._changed.clear()

    def close(self) -> None:
        """Tell the processes that the run is over. Harmless when repeated."""
        for entity in reversed(self._declared):
            entity.undeclare()
        self._declared.clear()

    def _on_change(self, sample: zenoh.Sample) -> None:
        who = parse_node_token(str(sample.key_expr))
        with self._lock:
            if sample.kind == zenoh.SampleKind.PUT:
                self._present.add(who)
            else:
                self._present.discard(who)
                if who[0] in self.departures:
                    self.departures[who[0]].put(None)
        self._changed.set()


class Stepper:
    """Steps one process."""

    def __init__(self, bus: Bus, attendance: Attendance, node: str, session: str, timeout_s: float) -> None:
        self.node = node
        """By whose name the process was asked for."""
        self.session = session
        """Of the process."""
        self._bus = bus
        self._attendance = attendance
        self._timeout_s = timeout_s
        self._answers: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._querier: Any = bus.session.declare_querier(
            step_key(bus.domain_id, node),
            target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=timeout_s + _MARGIN_S,
        )
        self._sequence = 0
        self._mirror = Mirror(bus)
        attendance.departures[session] = self._answers

    @property
    def nodes(self) -> tuple[str, ...]:
        """Full names of the nodes of the process."""
        return tuple(self._mirror.nodes)

    def step(self, tick: int) -> None:
        """Let the process run its nodes once, and do on the bus what they did.

        Raises:
            BridgeError: it does not answer in time, or has gone.
        """
        self._sequence += 1
        bus, sequence = self._bus, self._sequence
        now_ns = bus.clock.now_ns
        answers = self._answers

        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                answers.put((sequence, reply.ok.payload.to_bytes()))

        self._querier.get(
            direct(on_reply, lambda: answers.put((sequence, None))),
            payload=requests.encode(STEP.Request(tick, stamp(now_ns), self._mirror.take())),
            attachment=pack_attachment(sequence, now_ns, bytes(16)),
        )
        response = responses.decode(self._wait(sequence, tick))
        self._mirror.replay(response.sent)

    def close(self) -> None:
        """Take the nodes of the process off the bus."""
        self._attendance.departures.pop(self.session, None)
        self._mirror.close()
        self._querier.undeclare()

    def _wait(self, sequence: int, tick: int) -> bytes:
        seconds = self._bus.clock.now_ns * 1e-9
        joining = tick == STEP.Request.JOIN
        what = "the request to join" if joining else f"tick {tick} (t = {seconds:.3f} s)"
        end = time.monotonic() + self._timeout_s
        while True:
            try:
                answer = self._answers.get(timeout=max(0.0, end - time.monotonic()))
            except queue.Empty:
                raise BridgeError(
                    f"the node {self.node} did not answer {what} within {self._timeout_s:g} s; is its "
                    "process stopped or busy? --wait-timeout gives it more time"
                ) from None
            if answer is None or answer == (sequence, None):
                raise BridgeError(
                    f"the node {self.node} left the run without an answer to {what}: its process has ended"
                )
            if answer[0] == sequence:
                return answer[1]


def patience(timeout_s: float, what: str) -> Iterator[None]:
    """Yield until so long [s] of wall time is over; after a moment people are told what is waited for."""
    start, told = time.monotonic(), False
    yield
    while (waited := time.monotonic() - start) <= timeout_s:
        if waited > _PATIENCE_S and not told:
            told = True
            _log.warning("waiting for %s, %g s at most", what, timeout_s)
        yield


def await_node(bus: Bus, attendance: Attendance, name: str, timeout_s: float) -> Stepper:
    """Wait for a node of another process to appear, and take the process in.

    Raises:
        BridgeError: it does not appear in time, or two processes offer the same one.
    """
    stepper = Stepper(bus, attendance, name, _session_of(attendance, name, timeout_s), timeout_s)
    stepper.step(STEP.Request.JOIN)
    return stepper


def _session_of(attendance: Attendance, name: str, timeout_s: float) -> str:
    for _ in patience(timeout_s, f"the node {name} to join"):
        if sessions := attendance.sessions(name):
            break
        attendance.wait(_POLL_S)
    else:
        others = f"; what has joined: {', '.join(attendance.nodes)}" if attendance.nodes else ""
        raise BridgeError(
            f"no node {name} has joined within {timeout_s:g} s; start its process, for example with "
            f"twin exec FILE.py:FACTORY --lockstep{others}"
        )
    if len(sessions) > 1:
        raise BridgeError(f"{len(sessions)} processes have a node {name}; node names are unique")
    return sessions[0]
