"""The recorder as a part of a run: crashes, determinism, several robots, cost."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from twin.errors import RecordingError
from twin.recording.digest import RunDigest
from twin.recording.player import has_vulkan, headless_viewer
from twin.recording.read_back import content_digest, read
from twin.recording.sink import RecordingConfig, RerunSink
from twin.recording.stream import UnwrittenError

HERE = Path(__file__).parent

KILLED = """
import os, signal, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from conftest import FakeRun, RerunSink
import twin.recording.sink
run = FakeRun(duration_s=2.5)
twin.recording.sink.monotonic_ns = lambda: run.world.time_ns  # in real time
sink = RerunSink(Path(sys.argv[2]))
sink.declare(run.world)
for samples in run.ticks():
    for sample in samples:
        sink.on_sample(sample)
    sink.on_tick(run.world)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.fixture(scope="session")
def killed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("killed") / "killed.rrd"
    process = subprocess.run([sys.executable, "-c", KILLED, str(HERE), str(path)], check=False)
    assert process.returncode == -signal.SIGKILL
    return path


@pytest.mark.parametrize("poses_hz", [25.0, 30.0, 33.3])
def test_poses_come_at_their_rate(tmp_path: Path, make_world: Any, poses_hz: float) -> None:
    sampled: list[int] = []

    class Watched(make_world):  # type: ignore[misc, valid-type]
        def body_poses(self) -> tuple[Any, Any]:
            sampled.append(self.time_ns)
            xyz, quat = super().body_poses()
            return xyz, quat

    world = Watched()
    sink = RerunSink(tmp_path / "poses.rrd", config=RecordingConfig(poses_hz=poses_hz))
    sink.declare(world)
    sampled.clear()
    for tick in range(1, 501):
        world.time_ns = tick * 20_000_000
        sink.on_tick(world)
    due = [k * 1e9 / poses_hz for k in range(1, int(10.0 * poses_hz) + 1)]
    assert len(sampled) == len(due)
    assert all(-1.0 <= time - at < 20e6 for time, at in zip(sampled, due, strict=True))
    sink.close()


def test_killed_run_keeps_all_but_its_last_second(killed: Path) -> None:
    content = read(killed)
    times, _ = content.scalars("/velocity/robot/linear/measured")
    assert times[-1] >= 1_500_000_000
    assert times.tolist() == list(range(0, times[-1] + 1, 20_000_000))
    assert "/verdict" not in content.entities


@pytest.mark.skipif(not has_vulkan(), reason="no Vulkan driver: apt-get install mesa-vulkan-drivers")
def test_killed_run_opens_in_the_viewer(killed: Path) -> None:
    with headless_viewer(killed, time_s=1.5) as client:
        state = client.get_state()
        (end,) = (line.end for line in state.recordings[0].timelines if line.name == "sim_time")
        assert end >= 1_500_000_000
        assert [report for view in state.views for report in view.reports] == []


def test_equal_runs_are_equal_whatever_their_blocks(make_run: Any, verdict: Any, tmp_path: Path) -> None:
    digests = []
    for i, loss_s in enumerate((1.0, 1.0, 1e-9)):
        sink = RerunSink(tmp_path / f"{i}.rrd", config=RecordingConfig(loss_s=loss_s))
        make_run(duration_s=1.5).play(
            sink, {**verdict, "metrics": {"wall_time_s": i, "pace_losses": i, "pace_lost_s": i}}
        )
        digests.append(content_digest(tmp_path / f"{i}.rrd"))
    assert digests[0] == digests[1] == digests[2]
    make_run(duration_s=1.46).play(RerunSink(tmp_path / "other.rrd"))
    assert content_digest(tmp_path / "other.rrd") != digests[0]


def test_two_robots_keep_apart(make_run: Any, make_world: Any, tmp_path: Path) -> None:
    class Pair(make_world):  # type: ignore[misc, valid-type]
        def __init__(self) -> None:
            super().__init__(crates=0, robot_name="r1")
            self.body_names += tuple(name.replace("r1/", "r2/") for name in self.body_names)

        def body_poses(self) -> tuple[Any, Any]:
            xyz, quat = super().body_poses()
            return np.concatenate((xyz, xyz + 1.0)), np.concatenate((quat, quat))

    run = make_run(duration_s=1.0, namespace="r2", world=Pair())
    run.play(RerunSink(tmp_path / "pair.rrd"))
    content = read(tmp_path / "pair.rrd")
    assert content.column("/ros/r2/scan", "CoordinateFrame:frame").values[-1] == ["origin of /r2/scan"]
    children = [row[0] for row in content.column("/tf", "Transform3D:child_frame").values]
    first = content.column("/tf", "Transform3D:translation").numpy()[children.index("r2/base_scan"), 0]
    seen_from = content.column("/tf_topics/r2/scan", "Transform3D:translation").numpy()[0, 0]
    np.testing.assert_allclose(seen_from, first, atol=1e-6)
    belief = {row[0] for row in content.column("/tf_belief/r2", "Transform3D:child_frame").values}
    assert belief == {"/r2/odom", "/r2/base_footprint"}
    assert content.column("/tf_static/r2/map", "Transform3D:child_frame").values == [["/r2/map"]]
    assert len(content.scalars("/velocity/r2/linear/commanded")[0]) == 51
    assert not any(entity.startswith("/velocity/r1") for entity in content.entities)


def test_samples_before_the_world_are_kept(make_run: Any, tmp_path: Path) -> None:
    """Latched topics, such as the map, are published while a run is still being built."""
    run = make_run(duration_s=0.0)
    sink = RerunSink(tmp_path / "early.rrd")
    (samples,) = run.ticks()
    for sample in samples:
        sink.on_sample(sample)
    sink.declare(run.world)
    sink.close()
    assert "/ros/map" in read(tmp_path / "early.rrd").entities


def test_unwritable_folder(make_world: Any, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError, match="cannot write the recording"):
        RerunSink(tmp_path / "file" / "a.rrd").declare(make_world())


@pytest.mark.parametrize(
    ("speed", "expected"),
    [
        (1.0, [0, 100, 900, 1000, 1800, 1900, 2700, 2800]),
        (0.1, [0, 100, 900, 1000, 1800, 1900, 2700, 2800]),  # a second of simulated time is lost at most,
        (2.0, [0, 200, 1800, 2000]),  # or one of wall time
    ],
)
def test_a_run_goes_on_while_a_block_is_written(
    make_run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, speed: float, expected: list[int]
) -> None:
    """It waits for no block at once, and sends none before the one before is in the file."""
    sink, run = RerunSink(tmp_path / "a.rrd"), make_run(duration_s=3.0)
    monkeypatch.setattr("twin.recording.sink.monotonic_ns", lambda: round(run.world.time_ns / speed))
    done: list[tuple[str, int]] = []
    for name in ("begin_flush", "flush"):
        monkeypatch.setattr(
            f"twin.recording.stream.{name}", lambda *_, name=name: done.append((name, run.world.time_ns))
        )
    sink.declare(run.world)
    for _ in run.ticks():
        sink.on_tick(run.world)
    assert [name for name, _ in done] == ["begin_flush", "flush"] * (len(expected) // 2)
    assert [time_ns // 1_000_000 for _, time_ns in done] == expected
    monkeypatch.undo()
    sink.close()


class _Screen:
    def __init__(self) -> None:
        self.shown: list[int] = []
        self.is_over = False
        self.now_ns = lambda: 0

    def open(self, *_: Any) -> None: ...

    def put(self, action: Any, *, lasting: bool = False) -> None:
        self.shown.append(self.now_ns())

    def finish(self) -> None:
        self.is_over = True


@pytest.mark.parametrize("told", ["told", "", "with a screen"])
def test_a_full_disk_is_told_once(
    make_run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, told: str
) -> None:
    """Also if it fills up while the run is not looking: with the block after; raised if nobody is there."""
    lost: list[RecordingError] = []
    screen: Any = _Screen() if told == "with a screen" else None
    sink = RerunSink(tmp_path / "a.rrd", on_loss=lost.append if told else None, screen=screen)
    run = make_run(duration_s=3.0)
    monkeypatch.setattr("twin.recording.sink.monotonic_ns", lambda: run.world.time_ns)
    sink.declare(run.world)

    def full(recording: Any, path: Path | None) -> None:
        if path is not None:
            raise UnwrittenError(f"{path}: is the disk full?")

    monkeypatch.setattr("twin.recording.stream.flush", full)

    def play() -> None:
        for samples in run.ticks():
            for sample in samples:
                sink.on_sample(sample)
            sink.on_tick(run.world)

    if screen is not None:
        screen.now_ns = lambda: run.world.time_ns
    if told:
        play()
        sink.close()
        assert [str(fault) for fault in lost] == [f"{tmp_path / 'a.rrd'}: is the disk full?"]
        if screen is not None:
            assert (max(screen.shown), screen.is_over) == (3_000_000_000, True)
        return
    with pytest.raises(RecordingError, match="is the disk full"):
        play()
    assert run.world.time_ns <= 1_900_000_000
    with pytest.raises(RecordingError, match="is the disk full"):
        sink.close()


def test_config_names_every_problem() -> None:
    with pytest.raises(RecordingError, match=r"poses_hz is 0.*loss_s is -1"):
        RecordingConfig(poses_hz=0, loss_s=-1)


def test_a_run_without_recording_does_not_load_rerun() -> None:
    modules = "twin.recording.sink, twin.recording.player, twin.recording.digest"
    code = f"import sys, {modules}; assert 'rerun' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_digest_tells_every_difference(recorded: Any) -> None:
    def digest(samples: list[Any], state: bytes = b"s") -> str:
        run = RunDigest()
        for sample in samples:
            run.on_sample(sample)
        return run.finish(state)

    samples = recorded.samples[:20]
    reference = digest(samples)
    assert digest(list(samples)) == reference
    assert digest(samples, b"t") != reference
    assert digest([samples[1], samples[0], *samples[2:]]) != reference
    assert digest(samples[:-1]) != reference
    for change in ({"topic": "/other"}, {"msgtype": "a/msg/B"}, {"time_ns": 5}, {"payload": b"x"}):
        assert digest([*samples[:-1], replace(samples[-1], **change)]) != reference


@pytest.mark.bench
def test_cost(make_run: Any, make_world: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Prints CPU time per simulated second: 30 bodies at 25 Hz, 10 Hz scans, 50 Hz odometry and commands."""
    run = make_run(duration_s=10.0, world=make_world(crates=22))
    prepared = [(samples, run.world.time_ns, *run.world.body_poses()) for samples in run.ticks()]

    class Replay(make_world):  # type: ignore[misc, valid-type]
        poses: Any = prepared[0][2:]

        def body_poses(self) -> Any:
            return self.poses

    world = Replay(crates=22)
    sink = RerunSink(tmp_path / "cost.rrd")
    sink.declare(world)
    digest = RunDigest()
    start = time.process_time()
    for samples, time_ns, *poses in prepared:
        world.time_ns, world.poses = time_ns, poses
        for sample in samples:
            sink.on_sample(sample)
        sink.on_tick(world)
    cost = (time.process_time() - start) / 10
    start = time.process_time()
    for samples, *_ in prepared:
        for sample in samples:
            digest.on_sample(sample)
    hashing = (time.process_time() - start) / 10
    sink.close()
    size = (tmp_path / "cost.rrd").stat().st_size / 10
    with capsys.disabled():
        print(  # noqa: T201
            f"\nrecording {1e6 * cost:.0f} µs, digest {1e6 * hashing:.0f} µs CPU, "
            f"{size / 1e3:.0f} kB per simulated s"
        )
