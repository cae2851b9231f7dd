"""A Rerun viewer that shows a stream while it is made, and that nobody who writes ever waits for.

Rerun's own senders hold up who logs when a viewer stops reading. So a thread of ours sends, and what it
cannot send in time is dropped. The viewer reads from a server in this process, which keeps the latest of what
it served, so that a viewer may open, or a page be loaded again, in the middle.
"""

from __future__ import annotations

import subprocess
import threading
from collections.abc import Callable
from contextlib import suppress
from copy import copy
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING

from twin.errors import RecordingError
from twin.recording.player import (
    LOCALHOST,
    free_port,
    has_display,
    listens,
    viewer_binary,
    viewer_environment,
    wait_for,
)

if TYPE_CHECKING:  # rerun takes 0.4 s to import
    import rerun as rr
    import rerun.blueprint as rrb

    _Act = Callable[[rr.RecordingStream], rr.RecordingStream | None]
    """Does something with a stream; returns the one that follows it, if there is one."""

LATE_S = 0.5
"""A viewer is as much behind, at most, if it reads."""
_KEPT = "100MB"
"""Of what was served, for viewers that open later: the oldest is dropped, what holds at all times stays."""
_MOST_WAITING = 100
"""Blocks that wait for a viewer that does not read."""
_MOST_LASTING = 10_000
"""Of what a later block may need."""
_LOOK_S = 0.5
"""How often is seen whether the viewer is still there."""
_DRAIN_S = 3.0
"""Longest wait at the end for what was not sent yet."""
_STOP_S = 3.0
"""A viewer that does not end when asked to is killed."""


class LiveScreen:
    """Starts a viewer for one stream: a window where there is a display, else a page for a browser.

    Order: construct, `open`, `put` whatever is to be shown, `finish`; `wait` for the user, `close`. To `open`
    again is to show another recording from then on.
    """

    def __init__(
        self, tell: Callable[[str], None], *, web: bool | None = None, headless: bool = False
    ) -> None:
        """Prepare; nothing is started yet.

        Args:
            tell: Called with a sentence for the user: the page's address, or that nothing is shown any more.
                Not always in the same thread.
            web: Serve a page, instead of opening a window; None: where there is no display.
            headless: The window is a picture in memory, for tests.

        Raises:
            RecordingError: The installation has no viewer.
        """
        self._binary = viewer_binary()
        self._tell = tell
        self._headless = headless
        self._web = web if web is not None else not (headless or has_display())
        self._port, self._viewer_port = free_port(), free_port()
        self._acts: SimpleQueue[_Act | None] = SimpleQueue()
        self._process: subprocess.Popen[bytes] | None = None
        self._thread: threading.Thread | None = None
        self._gone = self._closed = self._finished = False
        self._drained = threading.Event()
        self._lags = False
        self.dropped = 0
        """How many blocks were not shown, since the viewer did not read."""

    @property
    def page_url(self) -> str | None:
        """Address of the viewer in a browser; None if it has a window of its own."""
        if not self._web:
            return None
        return f"http://{LOCALHOST}:{self._viewer_port}/?url={self._served.replace('+', '%2B')}"

    @property
    def viewer_url(self) -> str:
        """Address of a viewer that is no page, for programs that control it."""
        return f"rerun+http://{LOCALHOST}:{self._viewer_port}/proxy"

    @property
    def process(self) -> subprocess.Popen[bytes]:
        """The viewer, or the server of its page; there is one from `open` on."""
        assert self._process is not None
        return self._process

    @property
    def _served(self) -> str:
        return f"rerun+http://{LOCALHOST}:{self._port}/proxy"

    def open(self, application_id: str, recording_id: str, blueprint: rrb.Blueprint) -> None:
        """Serve a stream, and start its viewer; the streams that follow reach the same viewer.

        Raises:
            RecordingError: The page is not served.
        """
        import rerun as rr

        from twin.recording.stream import handed_over, without_clock

        if self._thread is not None:
            self._finished = False

            def turn(_: rr.RecordingStream) -> rr.RecordingStream:
                stream = without_clock(rr.RecordingStream, application_id, recording_id)
                own = copy(blueprint)  # who opened it may be handing it over to a file
                with handed_over(own):
                    stream.connect_grpc(self._served, default_blueprint=own)
                return stream

            self.put(turn, lasting=True)
            return
        stream = without_clock(rr.RecordingStream, application_id, recording_id)
        served = rr.GrpcServerSink(LOCALHOST, self._port, server_memory_limit=_KEPT)
        with handed_over(blueprint):
            stream.set_sinks(served, default_blueprint=blueprint)
        self._thread = threading.Thread(target=self._send, args=(stream,), name="live screen", daemon=True)
        self._thread.start()
        self._process = subprocess.Popen(
            [self._binary, "--bind", LOCALHOST, *self._options()],
            env=viewer_environment(),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C is for us
        )
        if self._web:
            process = self._process
            wait_for(lambda: listens(self._viewer_port) or process.poll() is not None)
            if process.poll() is not None:
                raise RecordingError(f"the viewer did not start, it ended with code {process.returncode}")
            self._tell(
                f"watch at {self.page_url} on this computer; from another one after "
                f"ssh -L {self._viewer_port}:{LOCALHOST}:{self._viewer_port} "
                f"-L {self._port}:{LOCALHOST}:{self._port}"
            )

    def put(self, act: _Act, *, lasting: bool = False) -> None:
        """Have something done with the stream soon, or drop it if too much waits; never waits itself.

        Args:
            act: Called in another thread.
            lasting: Later ones may need it: it is dropped only if very much waits.
        """
        if self._gone or self._finished:
            return
        if self._acts.qsize() < (_MOST_LASTING if lasting else _MOST_WAITING):
            self._acts.put(act)
            return
        self.dropped += 1
        if not self._lags:
            self._lags = True
            self._tell("the viewer does not read: what it misses is dropped, and everything else goes on")

    @property
    def waiting(self) -> int:
        """How many blocks wait for a viewer to read."""
        return self._acts.qsize()

    def finish(self) -> None:
        """Send what waits, if the viewer reads; no more will come until it is opened again.

        Harmless when repeated.
        """
        if self._thread is not None and not (self._gone or self._finished):
            self._drained.clear()
            self._acts.put(None)
            self._drained.wait(_DRAIN_S)
            self._finished = True

    def wait(self) -> None:
        """Wait until the user closes the viewer; a page is served until Ctrl-C."""
        while self.is_open:
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(_LOOK_S)

    @property
    def is_open(self) -> bool:
        """Whether the viewer, or the server of its page, is there."""
        return self._process is not None and self._process.poll() is None

    @property
    def how_to_end(self) -> str:
        """A sentence for the user, when there is nothing more to come."""
        return "Ctrl-C ends the viewer" if self._web else "close the viewer's window to end"

    def close(self) -> None:
        """End the viewer. Harmless when repeated."""
        self._gone = self._closed = True
        self._acts.put(None)
        if self._process is not None and self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(_STOP_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        if self._thread is not None:
            self._thread.join(_DRAIN_S)

    def _options(self) -> list[str]:
        if self._web:
            return ["--serve-web", "--web-viewer-port", str(self._viewer_port), self._served]
        window = ["--headless", "--window-size", "1600x900"] if self._headless else []
        return [*window, "--port", str(self._viewer_port), "--hide-welcome-screen", "--connect", self._served]

    def _send(self, server: rr.RecordingStream) -> None:
        """Do what was put, in a thread of its own, until the viewer is closed."""
        stream = server
        while not (self._closed or self._gone):
            acts = self._waiting()
            for act in acts:
                following = None if act is None else act(stream)
                if following is not None:
                    if stream is not server:
                        stream.disconnect()
                    stream = following
            while not (_flushed(stream) or self._closed):
                pass
            if None in acts:
                self._drained.set()
            self._look()
        # Until then what was served stays: a window may still be reading it, a page be loaded again.
        for each in {id(stream): stream, id(server): server}.values():
            each.disconnect()

    def _waiting(self) -> list[_Act | None]:
        """Return what waits, after a moment if nothing does."""
        acts: list[_Act | None] = []
        with suppress(Empty):
            acts.append(self._acts.get(timeout=_LOOK_S))
            while True:
                acts.append(self._acts.get_nowait())
        return acts

    def _look(self) -> None:
        """Send no more to a viewer that has ended."""
        process = self._process
        if process is None or process.poll() is None or self._gone:
            return
        self._gone = True
        self._drained.set()
        if not (self._closed or self._finished):
            what = "was closed" if process.returncode == 0 else f"ended with code {process.returncode}"
            self._tell(f"the viewer {what}: nothing is shown any more, and everything else goes on")


def _flushed(stream: rr.RecordingStream) -> bool:
    """Wait a moment until all is served; tell whether it is, or never will be."""
    try:
        stream.flush(timeout_sec=_LOOK_S)
    except RuntimeError as fault:
        return "timed out" not in str(fault)
    return True
