"""What other threads want done in the one that runs the bus."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future as Done
from typing import Any

from twin.bridge.node import Node
from twin.bridge.services import Client, Future
from twin.bridge.types import ServiceType
from twin.errors import BridgeError

_CALL_S = 5.0
_MOST = 10_000
"""So many may wait: more come from somebody who floods."""


class Errands:
    """Functions that wait for the bus's thread; calls of services from others, which wait for the answer."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._waiting: deque[Callable[[], None]] = deque()
        self._clients: dict[tuple[str, str], Client] = {}

    def do(self, errand: Callable[[], None]) -> None:
        """Let the bus's thread do something at its next turn; called in any thread."""
        if len(self._waiting) < _MOST:
            self._waiting.append(errand)
            self._node.bus.external.wake()

    def run(self) -> None:
        """Do what waits; called in the bus's thread."""
        for _ in range(len(self._waiting)):
            self._waiting.popleft()()

    def call(self, name: str, typename: str, request: Any) -> Any:
        """Return the answer of a service; called in any thread but the bus's.

        Raises:
            BridgeError: nobody answers in time.
        """
        done: Done[Any] = Done()

        def begin() -> None:
            try:
                key = (name, typename)
                if key not in self._clients:
                    kind = ServiceType(typename)
                    self._clients[key] = self._node.create_client(kind, name, timeout_s=_CALL_S)
                self._clients[key].call_async(request).add_done_callback(end)
            except BridgeError as fault:
                done.set_exception(fault)

        def end(future: Future) -> None:
            if future.error is not None:
                done.set_exception(BridgeError(f"{name}: {future.error}"))
            else:
                done.set_result(future.result)

        self.do(begin)
        try:
            return done.result(_CALL_S)
        except TimeoutError:
            raise BridgeError(f"{name} has not answered in {_CALL_S:g} s") from None
