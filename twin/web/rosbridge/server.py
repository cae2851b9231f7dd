"""The websocket server: a thread that only moves bytes; what they mean is decided in the bridge's thread."""

from __future__ import annotations

import asyncio
import ssl
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from twin.errors import BridgeError
from twin.web.rosbridge.access import ROLES, STOPS, Role, Token, matches
from twin.web.rosbridge.bridge import Bridge, Limits
from twin.web.rosbridge.delivery import Delivery, Recipient
from twin.web.rosbridge.door import Door, given_token, is_loopback, peer_of
from twin.web.rosbridge.frames import Send, from_json, to_json
from twin.web.rosbridge.http.answers import Http, response
from twin.web.rosbridge.outbox import Outbox
from twin.web.rosbridge.pages import page_of, refusal
from twin.web.rosbridge.rates import Bucket
from twin.web.rosbridge.session import Session

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

_ONCE = (
    "Host", "Origin", "Upgrade", "Authorization", "Referer", "Sec-Fetch-Site", "If-None-Match",
)  # fmt: skip
"""Headers of which nobody knows which one is meant if there are two."""
_AUTH_S = 5.0
"""How long a client may take to tell its token [s]."""
_MOST_PENDING = 200
"""Messages of one client that wait for the bridge."""


@dataclass(frozen=True)
class ServerConfig:
    """Where clients come in, and who may."""

    address: str = "127.0.0.1"
    port: int = 9090
    """0: any that is free."""
    tokens: tuple[Token, ...] = ()
    """Empty: everybody may come in; only on loopback."""
    open_to: Role = ROLES["engineer"]
    """What everybody is where there are no tokens."""
    origins: tuple[str, ...] = ()
    """Of pages elsewhere that may connect, such as https://hall.example; 'null' is a page from a file."""
    hosts: tuple[str, ...] = ()
    """Names by which the server is called, beside addresses and this computer's name."""
    certificate: Path | None = None
    """PEM; with it the server speaks TLS."""
    key: Path | None = None
    folders: Mapping[str, Path] = field(default_factory=dict)
    """Files for browsers, see `page_of`."""
    packages: Path | None = None
    """A folder: ROS packages around it, and those of the environment, give their meshes. None: none does."""

    def __post_init__(self) -> None:
        """Refuse to be open to all."""
        if not self.tokens and not is_loopback(self.address):
            raise BridgeError(
                f"--address {self.address} is not this computer alone; with --token FILE others may come in"
            )


class Connection:
    """A client as both threads see it."""

    def __init__(
        self,
        name: str,
        role: Role | None,
        limits: Limits,
        websocket: ServerConnection,
        delivery: Delivery,
    ) -> None:
        self.name = name
        self.role = role
        """None until it has told its token."""
        self.recipient = Recipient(websocket, Outbox(limits.waiting_bytes))
        self.session: Session | None = None
        self.pending = 0
        self._delivery = delivery
        self.rate = Bucket(limits.messages_per_s)
        self._told_s = 0.0

    def send(self, frame: str | bytes, topic: str | None) -> None:
        """Let a frame be sent; called in any thread."""
        self._delivery.post(frame, topic, (self.recipient,))

    def refuse(self, why: str) -> None:
        """Tell a client, not more than once a second, that a message of it was dropped."""
        if time.monotonic() - self._told_s > 1.0:
            self._told_s = time.monotonic()
            self.send(to_json({"op": "status", "level": "error", "msg": why}), None)


@dataclass
class _Event:
    connection: Connection
    message: dict[str, Any] | None
    """None: it has gone."""


class Server:
    """Listens from `start` to `close`; `work` hands to a bridge what has come."""

    def __init__(self, config: ServerConfig, limits: Limits, wake: Callable[[], None]) -> None:
        self.connections: set[Connection] = set()
        self.recipients: dict[Session, Recipient] = {}
        """Who has joined the bridge."""
        self.address = ""
        """Such as ws://127.0.0.1:9090."""
        self._config, self._limits, self._wake = config, limits, wake
        self._stops: deque[_Event] = deque()
        self._events: deque[_Event] = deque()
        self._jobs: deque[Callable[[Bridge], None]] = deque()
        """What clients without a websocket want of the bridge."""
        self._door = Door(config, wake)
        self._http = Http(config, limits, self._door, self.ask, lambda: len(self.connections))
        self._ready = threading.Event()
        self._fault: Exception | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._end: asyncio.Event | None = None
        self._delivery: Delivery | None = None
        self._thread = threading.Thread(target=self._run, name="rosbridge", daemon=True)

    def start(self) -> None:
        """Begin to listen.

        Raises:
            BridgeError: the port is taken, the address is not this computer's, or a file of TLS is no good.
        """
        self._thread.start()
        self._ready.wait()
        if isinstance(self._fault, BridgeError):
            raise self._fault
        if self._fault is not None:
            where = f"{self._config.address}:{self._config.port}"
            raise BridgeError(f"rosbridge cannot listen on {where}: {self._fault}")

    def close(self) -> None:
        """Disconnect everybody. Harmless when repeated."""
        if self._loop is not None and self._end is not None and self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._end.set)
        self._thread.join(10.0)

    def work(self, bridge: Bridge) -> None:
        """Do what clients want, stops first; called in the bridge's thread."""
        while self._door.strangers:
            bridge.audit_stranger(*self._door.strangers.popleft())
        while self._jobs:
            self._jobs.popleft()(bridge)
        for _ in range(len(self._events)):
            self.stop(bridge)
            self._do(bridge, self._events.popleft())
        self.stop(bridge)

    @property
    def has_urgent(self) -> bool:
        """Whether `stop` has something to do."""
        return bool(self._stops)

    def together(self, sessions: Sequence[Session]) -> Send:
        """Return what sends a frame to all of these at once; called in the bridge's thread."""
        assert self._delivery is not None
        post, recipients = self._delivery.post, tuple(self.recipients[session] for session in sessions)
        return lambda frame, topic: post(frame, topic, recipients)

    def stop(self, bridge: Bridge) -> None:
        """Do what overtakes all else; called in the bridge's thread, as often as you like."""
        while self._stops:
            self._do(bridge, self._stops.popleft())

    def _do(self, bridge: Bridge, event: _Event) -> None:
        connection = event.connection
        if connection.session is None:
            assert connection.role is not None
            session = connection.session = bridge.join(
                connection.name, connection.role, connection.send, is_known=bool(self._config.tokens)
            )
            self.recipients[session] = connection.recipient
        if event.message is None:
            connection.session.close()
            del self.recipients[connection.session]
            return
        connection.pending -= 1
        connection.session.handle(event.message)

    def _run(self) -> None:
        try:
            asyncio.run(self._serve())
        except Exception as fault:
            self._fault = fault
        finally:
            self._ready.set()

    async def _serve(self) -> None:
        from websockets.asyncio.server import serve

        from twin.web.rosbridge.http.connection import WebConnection

        config, secure = self._config, None
        if config.certificate is not None:
            secure = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            try:
                secure.load_cert_chain(config.certificate, config.key)
            except (OSError, ssl.SSLError) as fault:
                files = " and ".join(str(file) for file in (config.certificate, config.key) if file)
                raise BridgeError(f"{files}: no certificate in PEM with its own key: {fault}") from None
        self._loop, self._end = asyncio.get_running_loop(), asyncio.Event()
        self._delivery = Delivery(self._loop, self._limits.stalled_s)
        async with serve(
            self._on_client,
            config.address,
            config.port,
            create_connection=WebConnection,
            open_timeout=None,  # see WebConnection
            process_request=self._on_request,
            max_size=self._limits.message_bytes,
            max_queue=16,
            compression=None,
            ssl=secure,
            server_header=None,
        ) as listening:
            host, port = next(iter(listening.sockets)).getsockname()[:2]
            shown = f"[{host}]" if ":" in host else host
            self.address = f"{'ws' if secure is None else 'wss'}://{shown}:{port}"
            self._ready.set()
            await self._end.wait()
            self._http.close()

    async def _on_request(self, websocket: ServerConnection, request: Request) -> Response | None:
        for name in _ONCE:
            if len(request.headers.get_all(name)) > 1:
                return response(refusal(400, f"more than one {name}"))
        if not self._door.is_own_name(request.headers.get("Host", "")):
            return response(refusal(403, "this server has another name"))
        if request.headers.get("Upgrade", "").lower() != "websocket":
            page = await self._http.answer(websocket, request)
            if page is None:
                page = page_of(self._config.folders, urlsplit(request.path).path)
            return response(page)
        if not self._door.is_welcome(request):
            return response(refusal(403, "pages of this origin may not connect"))
        if len(self.connections) + len(self._http.streams) >= self._limits.clients:
            return response(refusal(503, "too many clients"))
        given = given_token(request)
        if self._config.tokens and given is not None:
            token = self._door.checked(peer_of(websocket), given)
            if token is None:
                return response(refusal(401, "wrong token"))
            websocket.token = token  # type: ignore[attr-defined]
        return None

    def ask(self, job: Callable[[Bridge], None]) -> None:
        """Let the bridge's thread do something; called in any thread."""
        self._jobs.append(job)
        self._wake()

    async def _on_client(self, websocket: ServerConnection) -> None:
        from websockets.exceptions import ConnectionClosed

        token: Token | None = getattr(websocket, "token", None)
        role = token.role if token else None if self._config.tokens else self._config.open_to
        peer = peer_of(websocket)
        assert self._delivery is not None
        name = token.name if token else peer
        connection = Connection(name, role, self._limits, websocket, self._delivery)
        self.connections.add(connection)
        try:
            if connection.role is None:
                async with asyncio.timeout(_AUTH_S):
                    if not await self._is_authentic(websocket, connection, peer):
                        return  # what it has sent since then may be here already
            async for text in websocket:
                self._take(connection, text)
        except (ConnectionClosed, TimeoutError):
            pass
        finally:
            self.connections.discard(connection)
            connection.recipient.end()
            if connection.role is not None:
                # With the stops: who steered and is gone is stopped before others are heard.
                self._stops.append(_Event(connection, None))
                self._wake()

    async def _is_authentic(self, websocket: ServerConnection, connection: Connection, peer: str) -> bool:
        """Wait for the token, and close without one; raises TimeoutError, ConnectionClosed."""
        try:
            message = from_json(await websocket.recv())
        except BridgeError:
            message = {}
        secret = message.get("token") if message.get("op") == "auth" else None
        token = self._door.checked(peer, secret) if isinstance(secret, str) else None
        if token is None:
            await websocket.close(1008, "the first message is auth, with a token that is known")
            return False
        connection.role, connection.name = token.role, token.name
        return True

    def _take(self, connection: Connection, text: str | bytes) -> None:
        """Queue what a client says; a stop overtakes all else, and is never too much."""
        try:
            message = from_json(text)
        except BridgeError as error:
            connection.rate.may_go(time.monotonic())
            connection.refuse(str(error))
            return
        is_stop = _is_stop(message)
        if not is_stop and not connection.rate.may_go(time.monotonic()):
            connection.refuse(
                f"more than {self._limits.messages_per_s:g} messages a second: some were dropped"
            )
            return
        if not is_stop and connection.pending >= _MOST_PENDING:
            connection.refuse("the bridge is busy: some messages were dropped")
            return
        connection.pending += 1
        (self._stops if is_stop else self._events).append(_Event(connection, message))
        self._wake()


def _is_stop(message: dict[str, Any]) -> bool:
    name = message.get({"publish": "topic", "call_service": "service"}.get(str(message.get("op")), ""))
    return isinstance(name, str) and matches(f"/{name.lstrip('/')}", STOPS)
