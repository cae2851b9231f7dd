"""`twin.Simulation`: the run of `twin run`, step by step; it leaves nothing open, however it ends."""

from __future__ import annotations

import asyncio
import gc
import json
import os
import signal
import subprocess
import sys
import threading
import weakref
from pathlib import Path

import numpy as np
import pytest

import twin
from twin.bridge.bus import Bus
from twin.bridge.wire.interrupts import guard
from twin.files.writing import written_alone
from twin.runtime import run as plain_run


@pytest.fixture(autouse=True)
def nothing_stays_open(monkeypatch: pytest.MonkeyPatch) -> object:
    """Fail a test that leaves a bus open."""
    buses: list[weakref.ref[Bus]] = []
    original = Bus.of.__func__  # type: ignore[attr-defined]

    def opened(cls: type[Bus], *args: object, **options: object) -> Bus:
        bus = original(cls, *args, **options)
        buses.append(weakref.ref(bus))
        return bus

    monkeypatch.setattr(Bus, "of", classmethod(opened))
    handler = signal.getsignal(signal.SIGINT)
    yield
    assert all(bus is None or bus.wire.is_closed for bus in (ref() for ref in buses))
    assert (guard._users, signal.getsignal(signal.SIGINT)) == (0, handler)


def test_its_digest_is_that_of_twin_run(circle: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "twin.cli", "run", str(circle), "--json", "--no-record", "--out", "cli"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
    expected = json.loads(done.stdout)["digest"]
    assert plain_run(twin.load_scenario(circle)).digest == expected
    assert twin.run(circle).digest == expected
    with twin.Simulation(circle, out=tmp_path / "out", bag=True) as simulation:
        while simulation.step():
            simulation.truth.pose("diff_bot")
    assert (simulation.verdict.digest, simulation.verdict.verdict) == (expected, "pass")
    assert json.loads((tmp_path / "out" / "verdict.json").read_text("utf-8"))["digest"] == expected
    assert simulation.run() is simulation.verdict


def test_to_listen_changes_nothing(circle: Path) -> None:
    expected = twin.run(circle).digest
    with twin.Simulation(circle) as simulation:
        heard: list[object] = []
        simulation.subscribe("/odom", heard.append)
        simulation.run_until(1.0)
        simulation.wait_for_message("/robot_description")
        simulation.run()
    assert len(heard) > 100
    assert simulation.verdict.digest == expected


def test_two_at_once_are_two_single_runs(circle: Path) -> None:
    seeds = (1, 2)
    single = [twin.run(circle, seed=seed).digest for seed in seeds]
    both = [twin.Simulation(circle, seed=seed) for seed in seeds]
    while sum(simulation.step() for simulation in both):
        pass
    assert [simulation.finish().digest for simulation in both] == single
    assert single[0] != single[1]


def test_times_and_conditions(idle: Path) -> None:
    with twin.Simulation(idle, overrides={"duration": 2}) as simulation:
        assert simulation.run_until(0.5)
        assert simulation.time == pytest.approx(0.5)
        assert simulation.run_until(0.2), "a time that has gone by"
        assert not simulation.run_until(lambda: False, timeout=0.5)
        assert simulation.time == pytest.approx(1.0)
        assert simulation.run_until(lambda: simulation.time > 1.2)
        assert not simulation.run_until(5.0)
        assert simulation.over
        assert not simulation.step()
    assert simulation.verdict.verdict == "fail"
    with pytest.raises(twin.TwinError, match="the run of 'idle' has ended; make another"):
        simulation.step()


def test_a_script_drives_by_topics_services_and_actions(idle: Path) -> None:
    with twin.Simulation(idle) as simulation:
        simulation.publish("/cmd_vel", {"linear": {"x": 0.2}})
        assert simulation.run_until(lambda: simulation.truth.pose("diff_bot").xyz[0] > 0.02, timeout=2.0)
        simulation.publish("/cmd_vel", twin.msgs.new(twin.msgs.Twist))
        answer = simulation.call("/diff_drive_controller/get_parameters", {"names": ["wheel_radius"]})
        assert answer.values[0].double_value == pytest.approx(0.05)
        turned: list[float] = []
        goal = simulation.send_goal(
            "/spin", {"target_yaw": 1.0}, lambda f: turned.append(f.angular_distance_traveled)
        )
        assert simulation.run_until(lambda: goal.done, timeout=5.0)
        assert goal.succeeded
        assert turned[-1] > 0.9
        ticks: list[int] = []
        simulation.node.create_timer(100_000_000, lambda: ticks.append(simulation.node.now_ns))
        simulation.run_until(simulation.time + 1.0)
        assert len(ticks) == 10
    assert simulation.verdict.verdict == "pass"


def test_what_is_not_there_is_named(idle: Path) -> None:
    with twin.Simulation(idle) as simulation:
        with pytest.raises(twin.TwinError, match="has no topic /odm; did you mean '/odom'"):
            simulation.subscribe("/odm", print)
        with pytest.raises(twin.TwinError, match="has no action /spn; did you mean '/spin'"):
            simulation.send_goal("/spn")
        with pytest.raises(twin.TwinError, match="no service /nobody/get_parameters"):
            simulation.call("/nobody/get_parameters")
        with pytest.raises(twin.TwinError, match=r"nothing came on /cmd_vel within 0\.1 s"):
            simulation.wait_for_message("/cmd_vel", timeout=0.1)
        with pytest.raises(twin.TwinError, match=r"linear\.y"):
            simulation.publish("/cmd_vel", {"linear": {"y": "fast"}})
        with pytest.raises(twin.TwinError, match="has not ended"):
            simulation.verdict  # noqa: B018
    with pytest.raises(twin.TwinError, match=r"needs a folder: say where with out="):
        twin.Simulation(idle, bag=True)
    with pytest.raises(twin.TwinError, match="is read already"):
        twin.run(twin.load_scenario(idle), seed=1)


def test_overrides_are_python_or_text(idle: Path) -> None:
    scenario = twin.load_scenario(
        idle,
        {"duration": "2 min", "robots.0.pose": {"x": np.float64(1.5)}, "checks.0": {"energy": {"max": 3}}},
    )
    assert scenario.duration == 120.0
    assert scenario.robots[0].pose.pose.x == 1.5
    with pytest.raises(twin.TwinError, match="duration"):
        twin.load_scenario(idle, {"duration": -1})


class Dropped(Exception):
    """What a script may raise."""


def broken_by_exception(simulation: twin.Simulation) -> None:
    def fail() -> bool:
        raise Dropped("enough")

    simulation.run_until(0.3)
    with pytest.raises(Dropped), simulation:
        simulation.run_until(fail)


def broken_within_a_tick(simulation: twin.Simulation) -> None:
    def fail(_: object) -> None:
        raise Dropped("enough")

    simulation.subscribe("/odom", fail)
    with pytest.raises(Dropped):
        simulation.run()


def interrupted(simulation: twin.Simulation) -> None:
    def condition() -> bool:
        if simulation.time > 0.3:
            signal.raise_signal(signal.SIGINT)
        return False

    with pytest.raises(KeyboardInterrupt):
        simulation.run_until(condition)


def closed(simulation: twin.Simulation) -> None:
    simulation.run_until(0.3)
    simulation.close()


@pytest.mark.parametrize(
    ("end", "error"),
    [
        (broken_by_exception, "Dropped: enough"),
        (broken_within_a_tick, "Dropped: enough"),
        (interrupted, "interrupted"),
        (closed, "closed before its end"),
    ],
)
def test_a_run_that_its_user_stops_leaves_whole_files(
    circle: Path, tmp_path: Path, end: object, error: str
) -> None:
    out = tmp_path / "out"
    simulation = twin.Simulation(circle, out=out, bag=True)
    end(simulation)  # type: ignore[operator]
    assert (simulation.verdict.verdict, simulation.verdict.error) == ("error", error)
    assert json.loads((out / "verdict.json").read_text("utf-8"))["error"] == error
    left_whole(out)


def left_whole(out: Path) -> None:
    with written_alone(out):  # nobody holds it
        pass
    recording = twin.read_recording(out / "circle.rrd")
    assert "/tf" in recording.entities
    bag = twin.read_bag(out / "bag")
    assert bag.notices == ()
    assert "/clock" in bag
    assert not list(out.glob(".*"))


def test_a_simulation_that_nobody_holds_is_closed(circle: Path, tmp_path: Path) -> None:
    """As a notebook's cell that is run again."""
    simulation: twin.Simulation | None = twin.Simulation(circle, out=tmp_path / "out", bag=True).start()
    simulation.step()
    simulation = None
    gc.collect()
    left_whole(tmp_path / "out")
    assert not (tmp_path / "out" / "verdict.json").exists()


def test_the_end_of_the_block_is_the_end_of_the_run(circle: Path, tmp_path: Path) -> None:
    with twin.Simulation(circle, out=tmp_path / "out", bag=True) as simulation:
        simulation.run_until(2.0)
    assert simulation.verdict.metrics["sim_time_s"] == pytest.approx(2.0)
    assert (simulation.verdict.verdict, simulation.verdict.error) == ("pass", None)
    left_whole(tmp_path / "out")


def test_a_mistake_leaves_a_verdict_that_tells_it(tmp_path: Path) -> None:
    simulation = twin.Simulation(tmp_path / "none.yaml", out=tmp_path / "out")
    with pytest.raises(twin.TwinError, match=r"none\.yaml"):
        simulation.run()
    assert "none.yaml" in json.loads((tmp_path / "out" / "verdict.json").read_text("utf-8"))["error"]


def test_two_do_not_write_into_one_folder(circle: Path, tmp_path: Path) -> None:
    with (
        twin.Simulation(circle, out=tmp_path / "out"),
        pytest.raises(twin.TwinError, match=f"process {os.getpid()} is writing there"),
    ):
        twin.run(circle, out=tmp_path / "out")


def test_in_a_notebook_an_interrupt_ends_the_cell(circle: Path) -> None:
    """An event loop runs in the main thread, and each cell has a handler of SIGINT, as with ipykernel."""
    simulations: list[twin.Simulation] = []

    async def first_cell() -> None:
        simulations.append(twin.Simulation(circle).start())
        simulations[0].run_until(0.2)

    async def second_cell() -> None:
        timer = threading.Timer(0.0, lambda: os.kill(os.getpid(), signal.SIGINT))
        simulations[0].subscribe("/clock", lambda _: timer.start() if not timer.ident else None)
        simulations[0].run_until(lambda: False)

    async def kernel() -> None:
        for cell in (first_cell, second_cell):
            saved = signal.signal(signal.SIGINT, signal.default_int_handler)
            try:
                await cell()
            except KeyboardInterrupt:
                interrupts.append(cell.__name__)
            finally:
                signal.signal(signal.SIGINT, saved)

    interrupts: list[str] = []
    asyncio.run(kernel())
    assert interrupts == ["second_cell"]
    assert simulations[0].verdict.error == "interrupted"


def test_in_another_thread(circle: Path) -> None:
    digests: list[str | None] = []
    thread = threading.Thread(target=lambda: digests.append(twin.run(circle).digest))
    thread.start()
    thread.join()
    assert digests == [twin.run(circle).digest]


HUNDRED = """
import ctypes, gc, sys
import twin

def resident():
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096 / 1e6

digests, sizes = set(), []
for number in range(1, 101):
    digests.add(twin.run(sys.argv[1], overrides={"duration": "0.4 s"}).digest)
    if number in (10, 100):
        sizes.append(resident())
print(len(digests), *sizes)
"""


@pytest.mark.long
def test_a_hundred_in_one_process_are_the_same_run_and_take_no_more_memory(circle: Path) -> None:
    """What is freed goes back to the system at once: else the C library's free lists feign a leak.

    The first runs fill caches of types, codecs and compiled kernels.
    """
    environment = {**os.environ, "MALLOC_TRIM_THRESHOLD_": "0", "MALLOC_MMAP_THRESHOLD_": "65536"}
    command = [sys.executable, "-c", HUNDRED, str(circle)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    different, after_10, after_100 = map(float, done.stdout.split())
    assert different == 1
    assert after_100 - after_10 < 4.0, "megabytes; a run that stayed would be 90 times several"
