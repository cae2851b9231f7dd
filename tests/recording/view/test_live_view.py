"""A robot in a real viewer, without a display: it follows the sliders, and everything ends together."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from twin.errors import RecordingError
from twin.models import load
from twin.recording import player
from twin.recording.view import live_view as live_view_module
from twin.recording.view.live_view import LiveViewConfig, live_view
from twin.recording.view.live_viewer import LiveViewer, connect
from twin.recording.view.posture import Posture
from twin.recording.view.robot_view import RobotView, robot_layout

needs_vulkan = pytest.mark.skipif(
    not player.has_vulkan(), reason="no Vulkan driver: apt-get install mesa-vulkan-drivers"
)


@needs_vulkan
def test_the_viewer_follows_the_posture(tmp_path: Path) -> None:
    from rerun.experimental import ViewerClient

    port = player.free_port()
    command = [player.viewer_binary(), "--bind", player.LOCALHOST, "--headless", "--port", str(port)]
    robot = load("r2d2")
    posture = Posture(robot)
    with subprocess.Popen(
        [*command, "--window-size", "400x300"],
        env=player.viewer_environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as process:
        try:
            player.wait_for(lambda: player.listens(port))
            url = f"rerun+http://127.0.0.1:{port}/proxy"
            viewer = LiveViewer(process=process, data_url=url, page_url=None)
            view = RobotView(connect(viewer, "twin-test", "r2d2", robot_layout(robot, posture)), robot)
            view.move(posture)
            client = ViewerClient(url)
            player.wait_for(lambda: bool(client.get_state().views))
            player.wait_for(lambda: times(client) == [0])
            posture.set({"swivel": 1.5})
            view.move(posture)
            player.wait_for(lambda: times(client) == [1])
            player.wait_for(lambda: complaints(client) == [])
            assert times(client) == [1]
            view.close()
        finally:
            process.terminate()


def complaints(client: Any) -> list[Any]:
    return [report for shown in client.get_state().views for report in shown.reports]


def times(client: Any) -> list[int]:
    return [recording.current_time for recording in client.get_state().recordings]


def test_both_servers_end_with_the_viewer_or_ctrl_c(monkeypatch: pytest.MonkeyPatch) -> None:
    events: list[str] = []

    class Process:
        def __init__(self, ending: int | BaseException) -> None:
            self.ending = ending

        def wait(self, timeout: float) -> int:
            if isinstance(self.ending, BaseException):
                raise self.ending
            return self.ending

    ending: int | BaseException = 3

    @contextmanager
    def viewer(*, web: bool) -> Iterator[LiveViewer]:
        process: Any = Process(ending)
        yield LiveViewer(process=process, data_url="", page_url="http://127.0.0.1:1/" if web else None)
        events.append("viewer ended")

    class View:
        def __init__(self, *_: object) -> None: ...

        def move(self, _: Posture) -> None: ...

        def close(self) -> None:
            events.append("recording closed")

    monkeypatch.setattr(live_view_module, "live_viewer", viewer)
    monkeypatch.setattr(live_view_module, "connect", lambda *_: None)
    monkeypatch.setattr(live_view_module, "RobotView", View)
    monkeypatch.setattr(live_view_module, "inspect_robot", lambda _: ())
    robot = load("r2d2")
    config = LiveViewConfig(web=True, port=player.free_port(), open_page=False)
    urls: list[str] = []
    assert live_view("r2d2", robot, Posture(robot), config, on_ready=urls.append) == 3
    assert events == ["recording closed", "viewer ended"]
    ending = KeyboardInterrupt()
    assert live_view("r2d2", robot, Posture(robot), config, on_ready=urls.append) == 0
    assert urls == [f"http://127.0.0.1:{config.port}/"] * 2
    assert not player.listens(config.port)


def test_no_display(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(player.sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    robot = load("r2d2")
    with pytest.raises(RecordingError, match=r"no display.*--web"):
        live_view("r2d2", robot, Posture(robot), LiveViewConfig())


def _in_the_background() -> None:
    """Ignore Ctrl-C, as what a shell's script starts with `&` does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def test_the_command_ends_cleanly_and_takes_its_viewer_along() -> None:
    port = player.free_port()
    command = [sys.executable, "-m", "twin.cli", "view", "r2d2", "--web", "--no-open", "--port", str(port)]
    pipes: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    with subprocess.Popen(command, preexec_fn=_in_the_background, **pipes) as twin:
        try:
            assert twin.stdout is not None
            first = twin.stdout.readline()
            children = Path(f"/proc/{twin.pid}/task/{twin.pid}/children")
            viewers = children.read_text().split() if children.exists() else []
        finally:
            twin.terminate()
        rest, _ = twin.communicate(timeout=120)
    assert (twin.returncode, first, rest) == (0, f"open http://127.0.0.1:{port}/\n", "")
    assert [pid for pid in viewers if Path(f"/proc/{pid}").exists()] == []
