"""Opens a recording in the viewer, and takes pictures of it without a display."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from shutil import which
from time import monotonic, sleep
from typing import TYPE_CHECKING

from twin.errors import RecordingError
from twin.files.writing import write_whole
from twin.recording.read_back import check_recording, check_whole, has_video, shown_time_s

if TYPE_CHECKING:
    from rerun.experimental import ViewerClient

LOCALHOST = "127.0.0.1"
_LOAD_TIMEOUT_S = 60.0
_NOTES_S = 1.0
"""Until what the viewer says of itself at its start has gone from the screen."""


def play(
    path: Path, *, web: bool = False, port: int = 9090, on_ready: Callable[[str], None] = lambda url: None
) -> int:
    """Show a recording until the user closes the viewer (or presses Ctrl-C for the web viewer).

    Args:
        path: The `.rrd` file, of a killed run too.
        web: Serve the viewer to a browser, instead of opening a window.
        port: Of the web viewer's page, on this computer only.
        on_ready: Called with the address of the page before it is served.

    Returns:
        The viewer's exit code.

    Raises:
        RecordingError: No such recording, no display, or the port is in use.
    """
    check_recording(path)
    command = [viewer_binary(), "--bind", LOCALHOST]
    if web:
        data_port = free_port()
        if listens(port):
            raise RecordingError(f"port {port} is in use; choose another one with --port")
        command += ["--serve-web", "--port", str(data_port), "--web-viewer-port", str(port)]
        on_ready(f"http://{LOCALHOST}:{port}/?url=rerun%2Bhttp://{LOCALHOST}:{data_port}/proxy")
    else:
        check_display()
        command += ["--port", str(free_port())]
    viewer = subprocess.Popen([*command, str(path)], env=viewer_environment())
    try:
        return viewer.wait()
    except KeyboardInterrupt:
        viewer.terminate()
        viewer.wait()
        return 0


def screenshot(path: Path, png: Path, *, time_s: float | None = None, view: str | None = None) -> None:
    """Write a picture of the viewer's window as PNG; needs a Vulkan driver, but no display.

    Args:
        path: The recording.
        png: To write.
        time_s: Simulated time to show [s]; None shows the start, of a graph that was watched the end.
        view: Name of one view, such as `Simulation`; None shows the whole window.

    Raises:
        RecordingError: No such recording or view, no Vulkan driver, or the picture cannot be written.
    """
    if png.suffix != ".png":
        raise RecordingError(f"{png}: not a picture that can be written; valid: *.png")
    check_whole(path)
    with headless_viewer(path, time_s=shown_time_s(path) if time_s is None else time_s) as client:
        view_id = None
        if view is not None:
            found = {v.name: v.view_id for v in client.get_state().views}
            if view not in found:
                raise RecordingError(f"no view {view!r} in {path}; valid: {', '.join(sorted(found))}")
            view_id = found[view]
        sleep(_NOTES_S)
        try:
            picture = client.take_screenshot(view_id)
        except ConnectionError as fault:
            raise RecordingError(f"the view {view!r} is behind another tab, and not drawn") from fault
        except TimeoutError as fault:
            raise RecordingError("the viewer drew nothing in time; is the computer busy?") from fault
    write_whole(png, picture)


def unshown(path: Path) -> str:
    """Return what the viewer shows of a recording on another computer, not on this one; empty if nothing.

    Rerun's own decodes no H.264, but has a program of that name do it; a browser does.

    Raises:
        RecordingError: No such recording.
    """
    if which("ffmpeg") is not None or not has_video(path):
        return ""
    return "the pictures are a video, which the viewer has ffmpeg decode: `apt-get install ffmpeg`, or --web"


@contextmanager
def headless_viewer(path: Path, *, time_s: float | None = None) -> Iterator[ViewerClient]:
    """Open a recording in a viewer without a window, and close the viewer at the end.

    Raises:
        RecordingError: No such recording, or the viewer does not start for want of a Vulkan driver.
    """
    check_whole(path)
    if not has_vulkan():
        raise RecordingError("no Vulkan driver for a picture; `apt-get install mesa-vulkan-drivers` has one")
    from rerun.experimental import ViewerClient

    port = free_port()
    command = [viewer_binary(), "--bind", LOCALHOST, "--headless", "--port", str(port)]
    command += ["--window-size", "1600x900", "--hide-welcome-screen"]
    with subprocess.Popen(
        command, env=viewer_environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as viewer:
        try:
            wait_for(lambda: listens(port) or viewer.poll() is not None)
            if viewer.poll() is not None:
                raise RecordingError("the viewer did not start; is there a working Vulkan driver?")
            client = ViewerClient(f"rerun+http://{LOCALHOST}:{port}/proxy")
            try:
                _open(client, path, time_s)
            except ConnectionError as fault:
                raise RecordingError("the viewer broke off; is there a working Vulkan driver?") from fault
            yield client
        finally:
            viewer.terminate()


def has_vulkan() -> bool:
    """Tell whether a Vulkan driver is installed (its manifest, where the Vulkan loader looks on Linux)."""
    if sys.platform != "linux":
        return True
    folders = ("/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d")
    return "VK_DRIVER_FILES" in os.environ or any(any(Path(f).glob("*.json")) for f in folders)


def viewer_binary() -> str:
    """Return the native viewer; the `rerun` script is a wrapper that leaves it running when killed.

    Raises:
        RecordingError: The installation has none.
    """
    spec = find_spec("rerun_cli")
    if spec is None or spec.origin is None:
        raise RecordingError("no Rerun viewer installed; `pip install rerun-sdk` has one")
    folder = Path(spec.origin).parent
    names = ("rerun", "rerun.exe", "Rerun.app/Contents/MacOS/Rerun")
    for name in names:
        if (folder / name).is_file():
            return str(folder / name)
    raise RecordingError(f"{folder}: no Rerun viewer here; `pip install rerun-sdk` installs one")


def viewer_environment() -> dict[str, str]:
    """Return the environment for a viewer that sends no usage data.

    Rerun 0.41 has no variable of its own for it: it stays silent under `CI`.
    """
    return {**os.environ, "RERUN_ANALYTICS": "0", "CI": "1"}


def free_port() -> int:
    """Return a TCP port of the loopback interface that nobody listens on."""
    with socket.socket() as probe:
        probe.bind((LOCALHOST, 0))
        return int(probe.getsockname()[1])


def _open(client: ViewerClient, path: Path, time_s: float | None) -> None:
    client.open(str(path.resolve()))
    wait_for(lambda: not client.get_state().loading and bool(client.get_state().recordings))
    if time_s is not None:
        client.set_time("sim_time", duration=time_s, play_state="paused")
    sleep(1.0)  # a view shows what it queried one frame earlier


def has_display() -> bool:
    """Tell whether a window can be opened."""
    if sys.platform != "linux":
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def check_display() -> None:
    """Raise RecordingError if no window can be opened."""
    if not has_display():
        raise RecordingError("no display to open the viewer on; --web serves it to a browser")


def listens(port: int) -> bool:
    """Tell whether a server listens on a port of this computer."""
    with socket.socket() as probe:
        return probe.connect_ex((LOCALHOST, port)) == 0


def wait_for(condition: Callable[[], bool]) -> None:
    """Wait for something that the viewer does; raises RecordingError if it takes too long."""
    deadline = monotonic() + _LOAD_TIMEOUT_S
    while not condition():
        if monotonic() > deadline:
            raise RecordingError(f"the viewer did not answer within {_LOAD_TIMEOUT_S:.0f} s")
        sleep(0.05)
