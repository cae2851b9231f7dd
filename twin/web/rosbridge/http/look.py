"""The newest message of a topic, for who is served in another thread than the bridge's."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection
from functools import partial
from typing import TYPE_CHECKING

from twin.errors import BridgeError
from twin.web.rosbridge.frames import Heard

if TYPE_CHECKING:
    from twin.web.rosbridge.bridge import Bridge

Ask = Callable[[Callable[["Bridge"], None]], None]
"""Lets the bridge's thread do something."""


class NoTopicError(Exception):
    """Nobody publishes what is asked for, or it is of another type."""


class Look:
    """Hears a topic while it is open; one that nobody looks at is not heard, so a camera need not draw."""

    def __init__(self, ask: Ask, topic: str, types: Collection[str]) -> None:
        """Begin to hear a topic of one of some types; in the server's thread."""
        self._ask, self._topic, self._types = ask, topic, types
        self._loop = asyncio.get_running_loop()
        self._filled = asyncio.Event()
        self._newest: Heard | None = None
        self._fault: str | None = None
        ask(self._begin)

    async def next(self) -> Heard:
        """Return the newest message, once there is one that has not been returned.

        Raises:
            NoTopicError: says what is wrong with the topic.
        """
        await self._filled.wait()
        self._filled.clear()
        if self._fault is not None:
            raise NoTopicError(self._fault)
        assert self._newest is not None
        return self._newest

    def close(self) -> None:
        """Hear no more."""
        self._ask(lambda bridge: bridge.topics.unwatch(self, self._topic))

    def _begin(self, bridge: Bridge) -> None:
        fault = fault_of(bridge, self._topic, self._types)
        if fault:
            self._tell(None, fault)
        else:
            bridge.topics.watch(self, self._topic, partial(self._tell, fault=None))

    def _tell(self, heard: Heard | None, fault: str | None) -> None:
        self._newest, self._fault = heard, fault
        try:
            self._loop.call_soon_threadsafe(self._filled.set)
        except RuntimeError:
            return  # the server has ended


def fault_of(bridge: Bridge, topic: str, types: Collection[str]) -> str:
    """Return why a topic is not one of some types, empty if it is."""
    try:
        found = bridge.topics.type_of(topic)
    except BridgeError as error:  # no name of a topic
        return str(error)
    if found is None:
        return f"nobody publishes {topic}"
    return "" if found in types else f"{topic} is a {found}, not a {' or '.join(types)}"
