"""Opening recordings: the screen has no errors, and mistakes are one sentence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
import rerun.blueprint as rrb
from PIL import Image

from twin.errors import RecordingError
from twin.recording import player
from twin.recording.read_back import WATCH, shown_time_s
from twin.recording.sink import RerunSink
from twin.recording.stream import end_recording, open_recording
from twin.recording.whole_messages import is_cut, whole_bytes

needs_vulkan = pytest.mark.skipif(
    not player.has_vulkan(), reason="no Vulkan driver: apt-get install mesa-vulkan-drivers"
)


@needs_vulkan
@pytest.mark.parametrize("time_s", [0.0, 2.5])
def test_screen_has_no_errors(recorded: Any, time_s: float) -> None:
    with player.headless_viewer(recorded.path, time_s=time_s) as client:
        state = client.get_state()
        (recording,) = state.recordings
        assert recording.current_timeline == "sim_time"
        names = {view.name for view in state.views}
        assert {"Simulation", "Map", "Mission", "Log", "Verdict", "Forward velocity [m/s]"} <= names
        assert [(view.name, report) for view in state.views for report in view.reports] == []


@needs_vulkan
def test_a_picture_shows_one_view_at_a_time(recorded: Any, tmp_path: Path) -> None:
    pictures = []
    for time_s in (0.0, 2.5):
        file = tmp_path / f"{time_s}.png"
        player.screenshot(recorded.path, file, time_s=time_s, view="Map")
        with Image.open(file) as image:
            pictures.append(np.asarray(image))
    assert pictures[0].shape == pictures[1].shape
    assert (pictures[0] != pictures[1]).any()


@needs_vulkan
def test_a_view_that_is_not_there_is_told_of(recorded: Any, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"no view 'Mab' in .*; valid: .*Map"):
        player.screenshot(recorded.path, tmp_path / "shot.png", view="Mab")
    assert not (tmp_path / "shot.png").exists()


@needs_vulkan
@pytest.mark.parametrize(
    ("opens_m", "shown"), [(0.0, "Localisation error [m, rad]"), (0.04, "Joints [m, rad]")]
)
def test_joints_that_stand_still_are_behind_the_error_of_localisation(
    make_run: Any, tmp_path: Path, opens_m: float, shown: str
) -> None:
    """What their encoders make of noise is no plot to begin with."""
    run, sink = make_run(duration_s=0.0), RerunSink(tmp_path / "a.rrd")
    sink.declare(run.world, {"robot": ["wheel_left_joint", "wheel_right_joint"]})
    (samples,) = run.ticks()
    (states,) = (sample for sample in samples if sample.topic == "/joint_states")
    for i, place in enumerate((0.0, 1e-4, 1e-4 + opens_m)):
        states.message.position = np.array([float(i), float(i), 2e-4 * i, place])
        sink.on_sample(states)
    sink.close()
    with player.headless_viewer(tmp_path / "a.rrd") as client:
        views = {view.name: view.view_id for view in client.get_state().views}
        plots = (name for name in views if name.startswith(("Joints", "Localisation")))
        assert [name for name in plots if _is_drawn(client, views[name])] == [shown]


def _is_drawn(client: Any, view_id: str) -> bool:
    try:
        return bool(client.take_screenshot(view_id))
    except ConnectionError:  # another tab is before it
        return False


def test_what_is_cut_within_a_message_is_told_and_not_waited_for(recorded: Any, tmp_path: Path) -> None:
    whole = recorded.path.read_bytes()
    for cut, size in ((True, len(whole) - 1000), (True, whole_bytes(recorded.path) + 7), (False, len(whole))):
        (tmp_path / "a.rrd").write_bytes((whole + bytes(7))[:size])
        assert is_cut(tmp_path / "a.rrd") == cut
        if cut:
            with pytest.raises(
                RecordingError, match=r"a\.rrd: the recording is damaged: it ends within a mes"
            ):
                player.screenshot(tmp_path / "a.rrd", tmp_path / "a.png", time_s=1.0)


def test_an_index_of_chunks_is_no_cut(tmp_path: Path) -> None:
    with rr.RecordingStream("twin") as recording:
        recording.save(tmp_path / "a.rrd")
        recording.log("/x", rr.TextLog("here"))
        recording.disconnect()
    assert b"RRF2FOOT" in (tmp_path / "a.rrd").read_bytes()
    assert not is_cut(tmp_path / "a.rrd")


@needs_vulkan
def test_a_vulkan_driver_that_does_not_work_is_told(
    recorded: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("VK_DRIVER_FILES", "VK_ICD_FILENAMES"):
        monkeypatch.setenv(name, "/nowhere")
    with pytest.raises(RecordingError, match="is there a working Vulkan driver"):
        player.screenshot(recorded.path, tmp_path / "a.png", time_s=1.0)


def test_a_picture_is_by_itself_of_a_runs_start_and_of_the_end_of_what_was_watched(
    recorded: Any, tmp_path: Path
) -> None:
    assert shown_time_s(recorded.path) is None
    path = tmp_path / "watched.rrd"
    recording = open_recording(path, WATCH, "graph", rrb.Blueprint())
    for time_s in (3.0, 5.5):
        recording.set_time("sim_time", duration=time_s)
        recording.log("/x", rr.TextLog("here"))
    end_recording(recording, path)
    assert shown_time_s(path) == 5.5


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"no\.rrd: cannot read the recording: No such file"):
        player.play(tmp_path / "no.rrd")


def test_something_else(tmp_path: Path) -> None:
    (tmp_path / "a.rrd").write_text("hello")
    with pytest.raises(RecordingError, match="not a Rerun recording"):
        player.play(tmp_path / "a.rrd")


def test_no_display(recorded: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(player.sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(RecordingError, match=r"no display.*--web"):
        player.play(recorded.path)


def test_web_viewer_serves_only_this_computer(recorded: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[list[str]] = []

    class Viewer:
        def __init__(self, command: list[str], **_: Any) -> None:
            started.append(command)

        def wait(self) -> int:
            return 0

    monkeypatch.setattr(player.subprocess, "Popen", Viewer)
    urls: list[str] = []
    assert player.play(recorded.path, web=True, port=player.free_port(), on_ready=urls.append) == 0
    assert started[0][1:3] == ["--bind", "127.0.0.1"]
    assert urls[0].startswith("http://127.0.0.1:")


def test_port_in_use(recorded: Any) -> None:
    import socket

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(RecordingError, match="in use"):
            player.play(recorded.path, web=True, port=taken.getsockname()[1])
