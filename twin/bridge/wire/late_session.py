"""A session that is opened when something needs it: a run that nobody can join has none, nor its threads."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import zenoh

from twin.errors import BridgeError

Make = Callable[[zenoh.Session], Any]


class LateSession:
    """What is declared before the session is opened waits, and is declared then, in the same order."""

    def __init__(self, open_it: Callable[[], zenoh.Session]) -> None:
        self._open_it = open_it
        self._session: zenoh.Session | None = None
        self._waiting: dict[_Late, None] = {}
        self._is_closed = False

    @property
    def is_open(self) -> bool:
        """Whether there is a session, so that Zenoh knows what was declared."""
        return self._session is not None

    @property
    def is_closed(self) -> bool:
        """Whether nothing is left of it."""
        return self._is_closed and (self._session is None or self._session.is_closed())

    @property
    def waiting_tokens(self) -> list[str]:
        """The liveliness tokens that a session would have, in the order of their declaration."""
        return [late.token for late in self._waiting if late.token]

    def open(self) -> zenoh.Session:
        """Return the session.

        Raises:
            BridgeError: it was closed before there was one, or cannot be opened.
        """
        if self._session is None:
            if self._is_closed:
                raise BridgeError("the bus is closed")
            self._session = self._open_it()
            for late in self._waiting:
                late.made = late.make(self._session)
            self._waiting.clear()
        return self._session

    def declare(self, make: Make) -> Any:
        """Return an entity of the session, or what becomes one when the session is opened or it is used."""
        return self._declared(make, "")

    def declare_token(self, token: str) -> Any:
        """Return a liveliness token, as `declare` does."""
        return self._declared(lambda session: session.liveliness().declare_token(token), token)

    def close(self) -> None:
        """Close the session, if there is one."""
        self._waiting.clear()
        self._is_closed = True
        if self._session is not None:
            self._session.close()  # type: ignore[no-untyped-call]

    def _declared(self, make: Make, token: str) -> Any:
        if self._session is not None:
            return make(self._session)
        late = _Late(self, make, token)
        self._waiting[late] = None
        return late

    def forget(self, late: _Late) -> None:
        """Declare something no more."""
        self._waiting.pop(late, None)


class Gone:
    """What stands for an entity of a session in a fork, which has none; nobody is there."""

    matching_status = SimpleNamespace(matching=False)

    def undeclare(self) -> None:
        """Do nothing."""

    def put(self, payload: bytes, attachment: bytes) -> None:
        """Tell nobody."""


class _Late:
    """An entity of a session that is not open yet."""

    def __init__(self, session: LateSession, make: Make, token: str) -> None:
        self.made: Any = None
        self.make, self.token = make, token
        self._session = session

    def undeclare(self) -> None:
        if self.made is None:
            self._session.forget(self)
        else:
            self.made.undeclare()

    def __getattr__(self, name: str) -> Any:
        """Use the entity."""
        self._session.open()
        return getattr(self.made, name)
