"""`twin view` from its start to Ctrl-C: a viewer, a page with sliders, and a file that may change."""

from __future__ import annotations

import subprocess
import webbrowser
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from twin.convert.inspection import inspect_file, inspect_robot
from twin.models.description import RobotDescription
from twin.models.options import DEFAULTS, ReadOptions
from twin.models.shapes import Collision, Mesh, Visual
from twin.recording.player import check_display, has_display
from twin.recording.view.live_viewer import LiveViewer, connect, live_viewer
from twin.recording.view.posture import Posture
from twin.recording.view.robot_session import RobotSession
from twin.recording.view.robot_view import APPLICATION_ID, SHOWN, RobotView, robot_layout
from twin.recording.view.slider_server import SliderServer

POLL_S = 0.5
"""How often a watched file is looked at."""


@dataclass(frozen=True, kw_only=True)
class LiveViewConfig:
    """How a robot is shown."""

    web: bool = False
    """The viewer is a part of the page, instead of a window of its own."""
    port: int = 9091
    """Of the page."""
    open_page: bool = True
    """Open the page in a browser, if there is a display."""
    watch: bool = False
    """Read the file again when it changes."""
    show: Sequence[str] = SHOWN
    """Layers that can be seen at first."""
    read: ReadOptions = DEFAULTS


def live_view(
    name_or_path: str | Path,
    description: RobotDescription,
    posture: Posture,
    config: LiveViewConfig,
    *,
    on_ready: Callable[[str], None] = lambda url: None,
    interrupted: Callable[[], bool] = lambda: False,
) -> int:
    """Show a robot until its viewer is closed or Ctrl-C is pressed; both servers end with it.

    Args:
        name_or_path: What was read.
        description: The robot in it.
        posture: Where its joints stand at first.
        config: How to show it.
        on_ready: Called with the address of the page when it is served.
        interrupted: Whether there was a Ctrl-C that was not raised, as while Python imports.

    Returns:
        The viewer's exit code; 0 after Ctrl-C.

    Raises:
        RecordingError: No display, no viewer, or the port is in use.
    """
    if not config.web:
        check_display()
    try:
        with ExitStack() as stack:
            viewer = stack.enter_context(live_viewer(web=config.web))
            session = RobotSession(description, posture, _painter(viewer, config.show))
            stack.callback(session.close)
            server = SliderServer(session, port=config.port, viewer_url=viewer.page_url)
            stack.enter_context(server.running())
            on_ready(server.url)
            if config.open_page and has_display():
                webbrowser.open(server.url)
            watcher = Watcher(description) if config.watch else None
            # Checking converts the robot, which may take seconds; the server lets it be moved meanwhile.
            session.diagnose(inspect_robot(description))
            while (code := _exit_code(viewer)) is None:
                if interrupted():
                    return 0
                if watcher is not None and watcher.changed():
                    watcher = reload(session, name_or_path, config.read, watcher)
            return code
    except KeyboardInterrupt:
        return 0


class Watcher:
    """Notices that one of the files of a robot was written."""

    def __init__(self, description: RobotDescription) -> None:
        """Remember the robot's file, its meshes, and all xacro files beside it."""
        source = description.source
        meshes = {
            shape.geometry.path
            for link in description.links.values()
            for shape in chain[Visual | Collision](link.visuals, link.collisions)
            if isinstance(shape.geometry, Mesh)
        }
        self._files = sorted({source, *source.parent.glob("*.xacro"), *meshes})
        self._stamps = self._read()

    def changed(self) -> bool:
        """Tell whether a file was written, or removed, since this was last asked."""
        before, self._stamps = self._stamps, self._read()
        return before != self._stamps

    def _read(self) -> list[tuple[int, int] | None]:
        return [_stamp(file) for file in self._files]


def reload(session: RobotSession, name_or_path: str | Path, read: ReadOptions, watcher: Watcher) -> Watcher:
    """Read a robot again and show it; with errors only these. Returns what to watch from now on."""
    found = inspect_file(name_or_path, read)
    if found.description is None:
        session.diagnose(found.diagnostics)
        return watcher
    session.replace(found.description, found.diagnostics)
    return Watcher(found.description)


def _painter(viewer: LiveViewer, show: Sequence[str]) -> Callable[[RobotDescription, Posture], RobotView]:
    """Return what draws a robot as a new recording: the viewer switches to the newest one by itself."""

    def draw(description: RobotDescription, posture: Posture) -> RobotView:
        blueprint = robot_layout(description, posture, show)
        return RobotView(connect(viewer, APPLICATION_ID, description.name, blueprint), description)

    return draw


def _exit_code(viewer: LiveViewer) -> int | None:
    """Wait a moment for the viewer to end; returns None if it did not."""
    try:
        return viewer.process.wait(POLL_S)
    except subprocess.TimeoutExpired:
        return None


def _stamp(file: Path) -> tuple[int, int] | None:
    try:
        status = file.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size
