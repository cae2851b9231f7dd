"""Questions to a robot's computer, which tell what its clock shows: every ROS 2 node answers some."""

from __future__ import annotations

import time
from collections import deque

from twin.bridge.bus import Bus
from twin.bridge.graph import Graph
from twin.bridge.services import Client, Future
from twin.bridge.srvs import GetParameters
from twin.live.mirror.clock_offset import ClockOffset, Offset

_PERIOD_NS = 100_000_000
_TIMEOUT_S = 10.0
"""An answer that takes longer tells nothing of a clock; Zenoh keeps every question for so long [s]."""
_DEPTH = 100
"""So many answers may wait, and so many questions may be open."""


class ClockExchanges:
    """Asks the node that publishes a topic for no parameters, ten times a second.

    The answer's `source_timestamp` is when it left, by the clock of the robot's computer.
    """

    def __init__(self, bus: Bus, graph: Graph, topic: str, *, namespace: str) -> None:
        """Ask whoever publishes `topic`, as soon as `graph` knows who that is."""
        self.node = bus.create_node("clock_exchanges", namespace)
        self.offset = ClockOffset()
        self.estimate: Offset | None = None
        """The robot's clock minus `time.perf_counter`; None: nobody has answered yet."""
        self.answered_ns: int | None = None
        """When an answer came last, by `time.perf_counter_ns`."""
        self._graph, self.topic, self._own = graph, topic, bus.session_id
        self._client: Client | None = None
        self._asked_ns = 0
        self._answers: deque[tuple[int, int, int]] = deque(maxlen=_DEPTH)
        self._open: deque[Future] = deque()

    def update(self) -> bool:
        """Ask if it is time to, take in what has been answered; return whether something has."""
        now_ns = time.perf_counter_ns()
        if now_ns - self._asked_ns >= _PERIOD_NS:
            self._ask(now_ns)
        fresh = False
        while self._answers:
            self.offset.add(*self._answers.popleft())
            fresh = True
        if fresh:
            self.answered_ns = now_ns
            self.estimate = self.offset.estimate()
        return fresh

    def other_ns(self, now_ns: int) -> int | None:
        """Return what the robot's clock shows at a `time.perf_counter_ns`; None: nobody has answered."""
        if self.estimate is None or self.answered_ns is None:
            return None
        drifted = (now_ns - self.answered_ns) * self.estimate.drift
        return now_ns + round(self.estimate.offset_s * 1e9) + round(drifted)

    def _ask(self, now_ns: int) -> None:
        others = (end.node for end in self._graph.publishers(self.topic) if end.node.session_id != self._own)
        server = next(others, None)
        if server is None:
            return
        service = f"{server.full_name}/get_parameters"
        if self._client is None or self._client.name != service:
            if self._client is not None:
                self.node.destroy_client(self._client)
                self._open.clear()
            self._client = self.node.create_client(GetParameters, service, timeout_s=_TIMEOUT_S)
            self._client.timed = lambda *exchange: self._answers.append(exchange)
        if self._client.service_is_ready:
            self._asked_ns = now_ns
            self._open.append(self._client.call_async(GetParameters.Request(names=[])))
            if len(self._open) > _DEPTH:
                self._client.remove_pending_request(self._open.popleft())
