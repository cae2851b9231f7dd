"""A run on a screen while it goes on: it gets there, and no viewer changes or holds up a run."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from twin import Simulation
from twin.recording import live_screen
from twin.recording.live_screen import LiveScreen
from twin.recording.player import has_vulkan, wait_for
from twin.recording.read_back import content_digest
from twin.recording.sink import RerunSink

Viewer = Callable[[str], None]
needs_vulkan = pytest.mark.skipif(not has_vulkan(), reason="no Vulkan driver")


@pytest.fixture
def told() -> list[str]:
    return []


@pytest.fixture
def screen(told: list[str]) -> Iterator[LiveScreen]:
    """The viewer, drawing in memory."""
    shown = LiveScreen(told.append, headless=True)
    yield shown
    shown.close()


@pytest.fixture
def viewer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Viewer:
    """Put a shell's commands in the place of the viewer, with a display."""

    def put(commands: str) -> None:
        program = tmp_path / "viewer"
        program.write_text(f"#!/bin/sh\n{commands}\n", encoding="utf-8")
        program.chmod(0o755)
        monkeypatch.setattr(live_screen, "viewer_binary", lambda: str(program))
        monkeypatch.setattr(live_screen, "has_display", lambda: True)

    return put


@needs_vulkan
def test_a_viewer_gets_what_the_file_gets(
    screen: LiveScreen, told: list[str], make_run: Any, verdict: Any, tmp_path: Path
) -> None:
    from rerun.experimental import ViewerClient

    make_run(duration_s=2.0).play(RerunSink(tmp_path / "alone.rrd"), verdict)
    make_run(duration_s=2.0).play(RerunSink(tmp_path / "shown.rrd", screen=screen), verdict)
    assert content_digest(tmp_path / "shown.rrd") == content_digest(tmp_path / "alone.rrd")
    client = ViewerClient(screen.viewer_url)

    def ends() -> list[int]:
        recordings = client.get_state().recordings
        return [line.end for shown in recordings for line in shown.timelines if line.name == "sim_time"]

    wait_for(lambda: bool(ends()) and ends() == [2_000_000_000])
    assert {"Simulation", "Map", "Verdict"} <= {view.name for view in client.get_state().views}
    # a viewer draws while it still reads: it misses things until all of them are there
    wait_for(lambda: not any(view.reports for view in client.get_state().views))
    assert told == []


@needs_vulkan
def test_a_viewer_that_stops_holds_up_nobody(screen: LiveScreen, make_run: Any, tmp_path: Path) -> None:
    run = make_run(duration_s=2.0)
    sink = RerunSink(tmp_path / "run.rrd", screen=screen)
    sink.declare(run.world)
    os.kill(screen.process.pid, signal.SIGSTOP)
    for samples in run.ticks():
        for sample in samples:
            sink.on_sample(sample)
        sink.on_tick(run.world)
    sink.close()
    make_run(duration_s=2.0).play(RerunSink(tmp_path / "alone.rrd"))
    assert content_digest(tmp_path / "run.rrd") == content_digest(tmp_path / "alone.rrd")
    os.kill(screen.process.pid, signal.SIGCONT)


def test_what_nobody_reads_is_dropped_and_told_once(
    viewer: Viewer, told: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    import rerun.blueprint as rrb

    viewer("exec sleep 600")
    monkeypatch.setattr(live_screen, "_flushed", lambda stream: bool(time.sleep(0.01)))
    monkeypatch.setattr(live_screen, "_DRAIN_S", 0.1)
    screen = LiveScreen(told.append)
    screen.open("twin", "run", rrb.Blueprint())
    done: list[int] = []
    try:
        screen.put(lambda stream: done.append(-1))
        wait_for(lambda: done == [-1])  # the thread waits now until that is read
        for i in range(1000):
            screen.put(lambda stream, i=i: done.append(i))  # type: ignore[misc]
        screen.put(lambda stream: done.append(-2), lasting=True)
        assert screen.dropped == 900
        assert told == ["the viewer does not read: what it misses is dropped, and everything else goes on"]
        monkeypatch.setattr(live_screen, "_flushed", lambda stream: True)
        screen.put(lambda stream: None)
        wait_for(lambda: len(done) > 1)
        assert done == [-1, *range(100), -2]  # what later blocks need is there
        screen.finish()
    finally:
        screen.close()


def test_another_recording_follows_on_the_same_screen(
    viewer: Viewer, told: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    import rerun.blueprint as rrb

    viewer("exec sleep 600")
    monkeypatch.setattr(live_screen, "_flushed", lambda stream: True)
    screen = LiveScreen(told.append)
    seen: list[str] = []
    try:
        for name in ("first", "second"):
            screen.open("twin", name, rrb.Blueprint())
            screen.put(lambda stream: seen.append(stream.get_recording_id()))
            screen.finish()
            screen.put(lambda stream: seen.append("too late"))
        assert seen == ["first", "second"]
        assert screen.is_open
        assert told == []
    finally:
        screen.close()


def test_a_viewer_that_is_closed_is_told_of_once(
    viewer: Viewer, told: list[str], make_run: Any, verdict: Any, tmp_path: Path
) -> None:
    viewer("exit 0")
    screen = LiveScreen(told.append)
    sink = RerunSink(tmp_path / "shown.rrd", screen=screen)
    run = make_run(duration_s=1.0)
    sink.declare(run.world)
    wait_for(lambda: told != [])
    for samples in run.ticks():
        for sample in samples:
            sink.on_sample(sample)
        sink.on_tick(run.world)
    sink.close(verdict)
    make_run(duration_s=1.0).play(RerunSink(tmp_path / "alone.rrd"), verdict)
    assert content_digest(tmp_path / "shown.rrd") == content_digest(tmp_path / "alone.rrd")
    assert told == ["the viewer was closed: nothing is shown any more, and everything else goes on"]
    screen.close()


def test_a_run_is_the_same_with_a_viewer(
    viewer: Viewer, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    viewer("exec sleep 600")
    options: dict[str, Any] = {"overrides": {"duration": "1s"}}
    alone = Simulation("diff_bot_figure8", **options).run()
    shown = Simulation("diff_bot_figure8", view=True, **options)  # nothing is written
    assert shown.run().digest == alone.digest
    recorded = Simulation("diff_bot_figure8", out=tmp_path / "out", view=True, **options)
    assert recorded.run().digest == alone.digest
    assert (tmp_path / "out" / "diff_bot_figure8.rrd").stat().st_size > 10_000
    assert capsys.readouterr().err == ""


def test_a_page_is_served_on_this_computer_where_there_is_no_display(
    told: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from urllib.request import urlopen

    import rerun.blueprint as rrb

    monkeypatch.setattr(live_screen, "has_display", lambda: False)
    screen = LiveScreen(told.append)
    screen.open("twin", "run", rrb.Blueprint())
    try:
        assert screen.page_url is not None
        assert screen.page_url.startswith("http://127.0.0.1:")
        with urlopen(screen.page_url) as page:
            assert b"Rerun" in page.read()
        (sentence,) = told
        assert sentence.startswith(f"watch at {screen.page_url} on this computer")
        assert sentence.count(" -L ") == 2
        assert screen.how_to_end == "Ctrl-C ends the viewer"
    finally:
        screen.close()
    assert screen.process.poll() is not None
