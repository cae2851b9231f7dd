"""A viewer that shows a recording while it is being made; the viewer listens, we send."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import rerun as rr
import rerun.blueprint as rrb

from twin.errors import RecordingError
from twin.recording.player import LOCALHOST, free_port, listens, viewer_binary, viewer_environment, wait_for

STOP_TIMEOUT_S = 5.0
"""A viewer that does not end when asked to is killed."""


@dataclass(frozen=True, kw_only=True)
class LiveViewer:
    """A viewer that was started and is ready for data."""

    process: subprocess.Popen[bytes]
    data_url: str
    page_url: str | None
    """Address of the viewer in a browser; None if it has a window of its own."""


@contextmanager
def live_viewer(*, web: bool) -> Iterator[LiveViewer]:
    """Start a viewer that takes data from this computer only, and end it at the end.

    Args:
        web: Serve it to a browser, instead of opening a window.

    Raises:
        RecordingError: There is no viewer, or it does not start.
    """
    port, page_port = free_port(), free_port()
    data_url = f"rerun+http://{LOCALHOST}:{port}/proxy"
    command = [viewer_binary(), "--bind", LOCALHOST, "--port", str(port)]
    command += ["--serve-web", "--web-viewer-port", str(page_port)] if web else ["--expect-data-soon"]
    page_url = f"http://{LOCALHOST}:{page_port}/?url={data_url.replace('+', '%2B')}" if web else None
    process = subprocess.Popen(
        command,
        env=viewer_environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # Ctrl-C is for us: the viewer ends after the last data was sent
    )
    try:
        ports = (port, page_port) if web else (port,)
        wait_for(lambda: all(map(listens, ports)) or process.poll() is not None)
        if process.poll() is not None:
            raise RecordingError(f"the viewer did not start, it ended with code {process.returncode}")
        yield LiveViewer(process=process, data_url=data_url, page_url=page_url)
    finally:
        _stop(process)


def connect(
    viewer: LiveViewer, application_id: str, name: str, blueprint: rrb.Blueprint
) -> rr.RecordingStream:
    """Return a stream into a viewer, as a new recording; nothing is sent before a flush."""
    recording = rr.RecordingStream(
        application_id, send_properties=False, batcher_config=rr.ChunkBatcherConfig.NEVER()
    )
    recording.set_log_tick_enabled(False)
    recording.set_log_time_enabled(False)
    recording.connect_grpc(viewer.data_url, default_blueprint=blueprint)
    recording.send_recording_name(name)
    return recording


def _stop(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(STOP_TIMEOUT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
