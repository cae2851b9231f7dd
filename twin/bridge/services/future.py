"""What a client is given at once for a response that comes later."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

from twin.errors import BridgeError


class Future:
    """A response that may not have come yet; done in a spin of the client's node.

    In executions and tasks: `response = yield from future`.
    """

    def __init__(self, service: str) -> None:
        self.done = False
        self._service = service
        self._response: Any = None
        self.error: str | None = None
        """Why there will be no response; None if there is one or it may still come."""
        self._callbacks: list[Callable[[Future], None]] = []

    @property
    def result(self) -> Any:
        """The response.

        Raises:
            BridgeError: nobody answered, or not yet.
        """
        if not self.done:
            raise BridgeError(f"{self._service} has not answered yet; look at `done` first")
        if self.error is not None:
            raise BridgeError(self.error)
        return self._response

    def add_done_callback(self, callback: Callable[[Future], None]) -> None:
        """Call back when done, at once if it is."""
        if self.done:
            callback(self)
        else:
            self._callbacks.append(callback)

    def __iter__(self) -> Generator[None, None, Any]:
        """Wait in an execution; the value is the response.

        Raises:
            BridgeError: nobody answered.
        """
        while not self.done:
            yield
        return self.result

    def cancel(self) -> None:
        """Wait no more; a response that comes later is ignored."""
        self.finish(None, f"the request to {self._service} was cancelled")

    def finish(self, response: Any, error: str | None = None) -> None:
        """Set the response, or why there is none; what comes later is ignored."""
        if self.done:
            return
        self.done, self._response, self.error = True, response, error
        for callback in self._callbacks:
            callback(self)
