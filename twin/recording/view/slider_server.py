"""The page with the sliders: a web server for this computer alone.

It serves one page and answers questions about one robot; it opens no other file. A page of another site that
is open in the same browser cannot use it: the Host must be ours (against DNS rebinding), a change must come
from our own page (Origin) as JSON, which browsers send across sites only with a permission that is not given.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from twin.errors import ModelError, RecordingError
from twin.recording.player import LOCALHOST
from twin.recording.view.posture import PRESETS
from twin.recording.view.robot_session import RobotSession

PAGE = Path(__file__).with_name("sliders") / "index.html"
MAX_BODY = 64 * 1024
"""Longest request that is read [bytes]."""
IDLE_TIMEOUT_S = 30.0
"""A connection that says nothing for so long is closed."""
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; "
    f"img-src data:; frame-src http://{LOCALHOST}:*; frame-ancestors 'none'; "
    "base-uri 'none'; form-action 'none'"
)


class BadRequest(Exception):
    """A request that is answered with an error; the text is for the page."""

    def __init__(self, status: HTTPStatus, message: str) -> None:
        super().__init__(message)
        self.status = status


class SliderServer(ThreadingHTTPServer):
    """Serves the page for a session."""

    daemon_threads = True

    def __init__(self, session: RobotSession, *, port: int, viewer_url: str | None = None) -> None:
        """Listen on the loopback interface.

        Args:
            session: What the page moves.
            port: To listen on; 0 takes a free one.
            viewer_url: Of a viewer that the page embeds.

        Raises:
            RecordingError: The port is in use.
        """
        self.session = session
        self.viewer_url = viewer_url
        self.page = PAGE.read_bytes()
        try:
            super().__init__((LOCALHOST, port), _Handler)
        except (OSError, OverflowError) as fault:
            raise RecordingError(f"port {port} cannot be used; choose another one with --port") from fault
        self.hosts = frozenset(f"{name}:{self.server_port}" for name in (LOCALHOST, "localhost"))

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{LOCALHOST}:{self.server_port}/"

    @contextmanager
    def running(self) -> Iterator[None]:
        """Serve in a thread of its own until the end of the block."""
        thread = threading.Thread(target=self.serve_forever, args=(0.05,), name="sliders", daemon=True)
        thread.start()
        try:
            yield
        finally:
            self.shutdown()
            thread.join()
            self.server_close()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of a browser that went away; anything else is a bug and is printed."""
        import sys

        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    """One connection."""

    server: SliderServer
    protocol_version = "HTTP/1.1"
    timeout = IDLE_TIMEOUT_S
    server_version = "twin"
    sys_version = ""

    def do_GET(self) -> None:
        """Answer `/`, `/state`, `/values`."""
        self._answer(self._get)

    def do_POST(self) -> None:
        """Answer `/values` (by name) and `/preset` (one of `PRESETS`)."""
        self._answer(self._post)

    def log_message(self, format: str, *args: Any) -> None:
        """Keep the terminal quiet."""

    def _get(self) -> tuple[str, bytes]:
        path = self.path.partition("?")[0]
        if path == "/":
            return "text/html; charset=utf-8", self.server.page
        if path == "/state":
            return _json({**self.server.session.state(), "viewer": self.server.viewer_url})
        if path == "/values":
            return _json(self.server.session.values())
        raise BadRequest(HTTPStatus.NOT_FOUND, "no such page; valid: /, /state, /values")

    def _post(self) -> tuple[str, bytes]:
        document = self._document()
        if self.path == "/values":
            return _json(self.server.session.set(_numbers(document)))
        if self.path == "/preset":
            name = document.get("preset")
            chosen = next((preset for preset in PRESETS if preset == name), None)
            if chosen is None:
                raise BadRequest(HTTPStatus.BAD_REQUEST, f"preset: must be one of {', '.join(PRESETS)}")
            return _json(self.server.session.preset(chosen))
        raise BadRequest(HTTPStatus.NOT_FOUND, "no such page; valid: /values, /preset")

    def _document(self) -> dict[str, Any]:
        """Return the JSON object in the body."""
        origin = self.headers.get("Origin")
        if origin is not None and origin.removeprefix("http://") not in self.server.hosts:
            raise BadRequest(HTTPStatus.FORBIDDEN, "requests of other pages are refused")
        if self.headers.get_content_type() != "application/json":
            raise BadRequest(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "Content-Type must be application/json")
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdigit()):
            raise BadRequest(HTTPStatus.LENGTH_REQUIRED, "Content-Length must be given")
        if len(length) > 9 or int(length) > MAX_BODY:
            raise BadRequest(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"at most {MAX_BODY} bytes")
        try:
            document = json.loads(self.rfile.read(int(length)))
        except (ValueError, RecursionError) as fault:
            raise BadRequest(HTTPStatus.BAD_REQUEST, "the body must be JSON") from fault
        if not isinstance(document, dict):
            raise BadRequest(HTTPStatus.BAD_REQUEST, "the body must be a JSON object")
        return document

    def _answer(self, respond: Any) -> None:
        try:
            if self.headers.get("Host") not in self.server.hosts:
                raise BadRequest(HTTPStatus.FORBIDDEN, f"this page is {self.server.url}")
            kind, body = respond()
            status = HTTPStatus.OK
        except BadRequest as fault:
            status, (kind, body) = fault.status, _json({"error": str(fault)})
        except ModelError as fault:
            status, (kind, body) = HTTPStatus.BAD_REQUEST, _json({"error": str(fault)})
        if status != HTTPStatus.OK:
            self.close_connection = True  # its body may be unread
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Content-Security-Policy", POLICY)
        self.end_headers()
        self.wfile.write(body)


def _json(document: Mapping[str, Any]) -> tuple[str, bytes]:
    return "application/json", json.dumps(document, allow_nan=False).encode()


def _numbers(document: Mapping[str, Any]) -> dict[str, float]:
    """Return the values of a request as numbers."""
    numbers = {}
    for name, value in document.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise BadRequest(HTTPStatus.BAD_REQUEST, f"{name}: must be a number")
        try:
            numbers[name] = float(value)
        except OverflowError as fault:
            raise BadRequest(HTTPStatus.BAD_REQUEST, f"{name}: is too large") from fault
    return numbers
