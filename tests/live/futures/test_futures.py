"""Futures of runs: what they are, and that nobody else notices them."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from tests.live.futures.conftest import Begin, digest, go_on, listening
from twin.bridge import live
from twin.bridge.msgs import Odometry, ns
from twin.errors import TwinError
from twin.live.futures import Futures, WhatIf
from twin.live.futures.futures import Answer
from twin.runtime.open_run import OpenRun
from twin.scenario.schema import load


def answer(
    run: OpenRun, jobs: int | None = None, time_limit_s: float | None = None, **asked: object
) -> Answer:
    with Futures(run, WhatIf(**asked), jobs=jobs, time_limit_s=time_limit_s) as futures:  # type: ignore[arg-type]
        return futures.wait()


def test_the_first_is_what_comes_and_the_run_notices_nothing(begin: Begin) -> None:
    alone = begin()
    go_on(alone, 4.0)
    run = begin()
    told = answer(run, n=3, horizon=3.0)
    first = told.outcomes[0]
    assert 1.0 < first.end_s < 3.0, "until it has arrived"
    go_on(run, 1.0 + first.end_s)
    assert first.digest == digest(run)
    go_on(run, 4.0)
    assert digest(run) == digest(alone)
    pose = run.run.world.pose("diff_bot/base_footprint").to_pose2()
    assert first.path[-1][1:3] == pytest.approx((pose.x, pose.y), abs=0.01)


def test_each_of_the_others_has_noise_of_its_own(begin: Begin) -> None:
    run = begin()
    one, again = answer(run, n=3, horizon=0.4), answer(run, n=3, horizon=0.4, jobs=1)
    digests = [outcome.digest for outcome in one.outcomes]
    assert len(set(digests)) == 3
    assert digests == [outcome.digest for outcome in again.outcomes], "the same question, the same answer"


def test_they_tell_arrival_clearance_and_checks(begin: Begin) -> None:
    told = answer(begin(), n=2, horizon=4.0)
    assert told.awaited == "the end of the mission"
    assert (told.succeeded, told.known) == (2, 2)
    for one in told.outcomes:
        assert one.end == "arrived"
        assert one.arrival_s == pytest.approx(2.1, abs=0.2), "2 s of driving, and a moment to stand"
        assert 0.1 < (one.clearance_m or 0.0) < 0.6
        assert one.path[0][0] == 0.0
        assert one.path[-1][1] > one.path[0][1] + 0.2
    told = answer(begin(checks="[{mission_succeeded: }, {time_limit: {limit: 2 s}}]"), n=2, horizon=4.0)
    assert (told.succeeded, told.known) == (0, 2)
    assert told.outcomes[0].failed_checks[0].startswith("time_limit")
    assert Answer.from_json(told.to_json()) == told


def test_what_is_asked_to_be_otherwise_is(begin: Begin) -> None:
    run = begin()
    _, x, y, _ = answer(run, n=1, horizon=1.0).outcomes[0].path[-1]
    _, short_x, short_y, _ = answer(run, n=1, horizon=1.0, set=("wheel_radius=0.5",)).outcomes[0].path[-1]
    assert (short_x**2 + short_y**2) < 0.8 * (x**2 + y**2)
    node = run.run.bus.create_node("governor")
    node.declare_parameter("names", ["none"])
    node.add_on_set_parameters_callback(lambda changed: os.kill(os.getpid(), signal.SIGKILL))
    assert "SIGKILL" in answer(run, n=1, set=("governor.names=[a, b]",)).outcomes[0].reason, (
        "it was set there"
    )
    assert run.run.faults is None


@pytest.mark.parametrize(
    ("asked", "why"),
    [
        ({"set": ("frictio=1",)}, "--set frictio=1: there is no 'frictio'; did you mean 'friction'?"),
        ({"set": ("friction=-1",)}, "friction"),
        ({"set": ("clock_offset=1 s",)}, "a clock cannot be changed"),
        ({"set": ("amcl.alpha1=1",)}, "there is no node 'amcl'"),
        ({"set": ("diff_drive_controller.speed=1",)}, "diff_drive_controller has no 'speed'"),
        ({"set": ("diff_drive_controller.linear.x.max_velocity=0.1",)}, "read-only"),
        ({"set": ("friction",)}, "must be KEY=VALUE"),
        ({"goal": (1.0, 2.0, 0.0)}, "--goal: robot 'diff_bot' does not navigate"),
        ({"goal": (1.0, float("nan"), 0.0)}, "must be three finite numbers"),
        ({"robot": "bob"}, "there is no robot 'bob'; Valid: diff_bot"),
        ({"n": 0}, "--n 0: must be from 1"),
        ({"horizon": -1.0}, "--horizon -1: must be more than 0"),
    ],
)
def test_what_cannot_be_asked_is_told_in_a_sentence(begin: Begin, asked: dict[str, object], why: str) -> None:
    with pytest.raises(TwinError) as told:
        answer(begin(0.1), **{"n": 1, **asked})
    assert why in str(told.value)


def test_a_future_that_dies_or_hangs_is_reported(begin: Begin) -> None:
    run = begin(0.1)
    parent, node = os.getpid(), run.run.bus.create_node("killer")

    def tick() -> None:
        if os.getpid() != parent and node.now_ns > 1_000_000_000:
            os.kill(os.getpid(), signal.SIGKILL)

    node.create_timer(100_000_000, tick)
    told = answer(run, n=2, horizon=3.0)
    assert [(one.end, one.reason) for one in told.outcomes] == [
        ("lost", "its process has ended by SIGKILL"),
        ("lost", "its process has ended by SIGKILL"),
    ]
    assert told.known == 0
    node.destroy()
    node = run.run.bus.create_node("sleeper")
    node.create_timer(100_000_000, lambda: os.getpid() != parent and time.sleep(1000.0))
    told = answer(run, n=1, horizon=3.0, time_limit_s=0.2)
    assert told.outcomes[0].reason == "it took longer than 0.2 s of wall time"


def test_a_bug_in_a_node_is_that_future_s_end(begin: Begin) -> None:
    run = begin(0.1)
    parent, node = os.getpid(), run.run.bus.create_node("wrong")
    node.create_timer(100_000_000, lambda: os.getpid() == parent or 1 // 0)
    assert answer(run, n=1, horizon=3.0).outcomes[0].reason.startswith("ZeroDivisionError")


def test_who_observes_the_run_is_told_nothing_of_futures(begin: Begin) -> None:
    parent = os.getpid()
    run = begin(0.1, taps=[lambda sample: os.getpid() == parent or os._exit(3)])
    assert answer(run, n=1, horizon=0.2).outcomes[0].end == "under way"


def test_all_end_with_who_asked(begin: Begin) -> None:
    run = begin(0.1)
    parent, node = os.getpid(), run.run.bus.create_node("sleeper")
    node.create_timer(100_000_000, lambda: os.getpid() != parent and time.sleep(1000.0))
    with Futures(run, WhatIf(n=2)) as futures:
        assert futures.poll(0.5) is None
        pid = futures._fork.pid
        children = Path(f"/proc/{pid}/task/{pid}/children")
        end = time.monotonic() + 60.0
        while len(pids := children.read_text().split()) < min(2, len(os.sched_getaffinity(0))):
            assert time.monotonic() < end
    assert not Path(f"/proc/{pid}").exists()
    while any(_is_there(child) for child in pids):
        assert time.monotonic() < end


def _is_there(pid: str) -> bool:
    status = Path(f"/proc/{pid}/stat")
    try:
        return status.read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_an_observer_outside_hears_the_run_only(begin: Begin, endpoint: str) -> None:
    run = begin(0.1, network=listening(endpoint), duration="60 s")
    world = run.run.world
    heard: list[int] = []
    with live.join((endpoint,)) as here:
        node = here.bus.create_node("observer")
        node.create_subscription(Odometry, "/odom", lambda m: heard.append(ns(m.header.stamp)), 1000)

        def listen() -> None:
            here.spin_once(0.0)

        run.between_ticks.append(listen)
        end = time.monotonic() + 60.0
        run.advance(lambda: bool(heard) or time.monotonic() > end)
        told = answer(run, n=2, horizon=2.0)
        assert [one.end_s for one in told.outcomes] == [2.0, 2.0] or told.succeeded == 2
        assert here.spin(lambda: heard[-1] >= world.time_ns - 20_000_000, timeout_s=60.0)
        assert heard[-1] <= world.time_ns, "nothing of the futures, which are 2 s ahead"
        go_on(run, world.time_ns * 1e-9 + 0.5)
        assert here.spin(lambda: heard[-1] >= world.time_ns - 20_000_000, timeout_s=60.0)
        run.between_ticks.remove(listen)
    assert heard == sorted(set(heard)), "each once"
    assert sum(stamp > world.time_ns - 500_000_000 for stamp in heard) >= 10, "it goes on talking"


def test_a_recording_goes_on_as_if_nothing_had_happened(begin: Begin, tmp_path: Path) -> None:
    from twin.recording.read_back import content_digest

    contents = []
    for asks in (False, True):
        out = tmp_path / str(asks)
        run = OpenRun(begin(0.0).run.scenario, out=out)
        try:
            go_on(run, 0.5)
            if asks:
                assert answer(run, n=2, horizon=0.2).outcomes[1].digest
            go_on(run, 1.0)
            run.finish()
        finally:
            run.close()
        contents.append(content_digest(out / "there_and_back.rrd"))
    assert contents[0] == contents[1]


NAVIGATES = """
name: navigates
seed: 1
duration: 100 s
world: {arena: warehouse}
robots: [{model: warehouse_bot, start: start, localisation: {type: amcl, map: warehouse}, navigation: {}}]
mission:
  type: behaviors
  robot: warehouse_bot
  steps: [{navigate_to_pose: {x: -7.2 m, y: -5.4 m}}, {wait: {duration: 90 s}}]
checks: [{no_collision: }]
"""


def test_in_the_middle_of_a_goal(tmp_path: Path, endpoint: str) -> None:
    file = tmp_path / "navigates.yaml"
    file.write_text(NAVIGATES, encoding="utf-8")
    run = OpenRun(load(file), record=False, network=listening(endpoint))
    try:
        go_on(run, 1.0)
        told = answer(run, n=2)
        assert told.awaited == "the goal under way"
        assert told.succeeded == 2
        first, other = told.outcomes
        assert first.digest != other.digest
        go_on(run, 1.0 + first.end_s)
        assert digest(run) == first.digest, "filters, trees and controllers go on as they were"
        go_on(run, 4.0)
        assert answer(run, n=1, horizon=0.1).awaited == "the end of the mission"
        (there,) = answer(run, n=1, goal=(-6.5, -5.4, 0.0)).outcomes
        assert there.end == "arrived", "and nothing of the mission holds it back"
        assert there.path[-1][1:3] == pytest.approx((-6.5, -5.4), abs=0.3)
        (nowhere,) = answer(run, n=1, goal=(-50.0, -5.4, 0.0)).outcomes
        assert (nowhere.end, nowhere.reason) == ("failed", "(-50.00, -5.40) is outside the costmap")
    finally:
        run.close()
