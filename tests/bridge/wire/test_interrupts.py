"""Ctrl-C at many moments: exit code 130, at once, nothing on the screen, nothing half-written."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.processes import free_endpoint
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.wire.interrupts import guard

ROOT = Path(__file__).parents[3]

_LIVE = """
import sys
try:
    from twin.bridge import live
    from twin.bridge.msgs import String
    with live.join(listen=[sys.argv[1]]) as process:
        node = process.bus.create_node("chatty")
        node.create_subscription(String, "x", lambda m: None)
        publisher = node.create_publisher(String, "x")
        node.create_timer(1_000_000, lambda: [publisher.publish(String("hi")) for _ in range(500)])
        for number in range(int(sys.argv[2])):
            try:
                print("spins", flush=True)
                process.spin()
            except KeyboardInterrupt:
                pass
        print("spins", flush=True)
        process.spin()
except KeyboardInterrupt:
    sys.exit(130)
"""


def _interrupt(process: subprocess.Popen[str], delay_s: float) -> tuple[int, str]:
    """Send SIGINT after some time: the moment is meant to be any."""
    try:
        process.wait(delay_s)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGINT)
    try:
        _, errors = process.communicate(timeout=120)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        pytest.fail(f"hangs after Ctrl-C at {delay_s} s")
    return process.returncode, errors


def test_a_process_that_publishes_all_the_time() -> None:
    """Most of its time it is in a callback that Zenoh calls, where an interrupt would be lost."""
    for times in (0, 6, 9):
        with subprocess.Popen(
            [sys.executable, "-c", _LIVE, free_endpoint(), str(times)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=ROOT,
        ) as process:
            assert process.stdout is not None
            for number in range(times):
                assert process.stdout.readline() == "spins\n"
                time.sleep(number * 0.003)  # any moment will do
                process.send_signal(signal.SIGINT)
            assert process.stdout.readline() == "spins\n"
            assert _interrupt(process, times * 0.002) == (130, "")


_JOIN = """
import sys
try:
    from twin.bridge import live
    print("joins", flush=True)
    with live.join([sys.argv[1]], timeout_s=60.0):
        pass
except KeyboardInterrupt:
    sys.exit(130)
"""


def test_a_process_that_looks_for_somebody() -> None:
    with subprocess.Popen(
        [sys.executable, "-c", _JOIN, free_endpoint()],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "joins\n"
        assert _interrupt(process, 0.3) == (130, "")


_RUN = "from twin.cli import main; print('begins', flush=True); main()"
"""Before it begins, the interpreter itself would end with a traceback."""


@pytest.mark.slow
def test_a_run_that_others_may_join(tmp_path: Path) -> None:
    """From its imports to its middle; a verdict is there whole or not at all."""
    for number in range(15):
        out = tmp_path / str(number)
        command = ["run", "scenarios/diff_bot_figure8.yaml", "--pace", "4", "--listen", free_endpoint()]
        with subprocess.Popen(
            [sys.executable, "-c", _RUN, *command, "--no-record", "--out", str(out)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=ROOT,
        ) as process:
            assert process.stdout is not None
            assert process.stdout.readline() == "begins\n"
            code, errors = _interrupt(process, 0.1 + number * 0.25)
        assert (code, "Traceback" in errors, "Error" in errors) == (130, False, False), (number, errors)
        left = sorted(file.name for file in out.iterdir()) if out.exists() else []
        whole = ["junit.xml", "verdict.json"]
        assert left in ([], whole, ["hashes.json", *whole]), number  # no hashes of a run that had not begun
        if left:
            assert json.loads((out / "verdict.json").read_text("utf-8"))["error"] == "interrupted"


def test_an_interrupt_inside_a_callback_comes_with_the_next_spin() -> None:
    with Bus.open(Clock()) as bus:
        from twin.bridge.wire.session import direct

        seen: list[str] = []

        def on_sample(sample: object) -> None:
            signal.raise_signal(signal.SIGINT)
            seen.append("the callback goes on")

        subscriber = bus.session.declare_subscriber("x", direct(on_sample))
        bus.session.put("x", b"")
        assert seen == ["the callback goes on"]
        with pytest.raises(KeyboardInterrupt):
            bus.spin()
        bus.spin()
        subscriber.undeclare()


def test_a_bus_closes_before_it_is_interrupted() -> None:
    bus = Bus.open(Clock())
    session = bus.session
    with guard.shield():
        signal.raise_signal(signal.SIGINT)
        time.sleep(0)
    with pytest.raises(KeyboardInterrupt):
        bus.close()
    assert session.is_closed()


def test_the_handler_of_before_is_back_afterwards() -> None:
    before = signal.getsignal(signal.SIGINT)
    with Bus.open(Clock()), Bus.open(Clock(), session="other"):
        assert signal.getsignal(signal.SIGINT) != before
    assert signal.getsignal(signal.SIGINT) == before
