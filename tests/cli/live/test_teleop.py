"""`twin teleop` in a terminal."""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import sys
import termios
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from twin.bridge import live
from twin.bridge.msgs import Twist, TwistStamped
from twin.bridge.qos import QoS

LONG_S = 100.0


class Terminal:
    """A pseudo-terminal in which the command runs."""

    def __init__(self, process: subprocess.Popen[bytes], fd: int) -> None:
        self.process, self.fd = process, fd

    def type(self, keys: str) -> None:
        os.write(self.fd, keys.encode())


@contextmanager
def teleop(endpoint: str, *words: str) -> Iterator[Terminal]:
    """Run it, end it with Ctrl-C if it has not ended, and see that the terminal is as it was."""
    here, there = pty.openpty()
    before = termios.tcgetattr(there)
    command = [sys.executable, "-m", "twin.cli", "teleop", "--connect", endpoint, *words]
    process = subprocess.Popen(command, stdin=there, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    try:
        yield Terminal(process, here)
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=LONG_S)
        after = termios.tcgetattr(there)
        os.close(here)
        os.close(there)
        assert (process.returncode, errors) == (0, b"")
        assert after == before, "the terminal is as it was"


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM])
def test_a_turtle_is_driven_and_stands_when_nobody_presses_a_key_and_at_the_end(
    endpoint: str, end: signal.Signals
) -> None:
    with live.join((), listen=[endpoint]) as world:
        got: list[float] = []
        node = world.bus.create_node("turtlesim")
        node.create_subscription(
            Twist, "/turtle1/cmd_vel", lambda message: got.append(message.linear.x), QoS(depth=100)
        )
        with teleop(endpoint) as terminal:
            for _ in range(1000):  # until it has joined and listens
                terminal.type("i")
                if world.spin(lambda: bool(got), 0.1):
                    break
            assert max(got) == 0.5
            assert world.spin(lambda: got[-1] == 0.0, LONG_S), "nobody presses a key"
            got.clear()
            terminal.type("\x1b[A")
            assert world.spin(lambda: 0.5 in got, LONG_S), "an arrow drives, too"
            terminal.process.send_signal(end)
            assert world.spin(lambda: got[-1] == 0.0, LONG_S)
            terminal.process.wait(LONG_S)


def test_a_multiplexer_goes_before_the_drive_and_stamps_are_sent_where_they_are_wanted(endpoint: str) -> None:
    with live.join((), listen=[endpoint]) as world:
        node = world.bus.create_node("robot")
        past: list[Twist] = []
        got: list[TwistStamped] = []
        node.create_subscription(Twist, "/cmd_vel", past.append, 10)
        node.create_subscription(TwistStamped, "/cmd_vel_teleop", got.append, QoS(depth=100))
        with teleop(endpoint, "--layout", "turtlebot3", "--frame", "base_link") as terminal:
            for _ in range(1000):
                terminal.type("a")
                if world.spin(lambda: bool(got), 0.1):
                    break
        assert got[0].header.frame_id == "base_link"
        assert got[0].header.stamp.sec > 0
        assert got[0].twist.angular.z == pytest.approx(0.1)
        assert not past


def test_without_a_terminal_it_says_so() -> None:
    command = [sys.executable, "-m", "twin.cli", "teleop"]
    ended = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=LONG_S)
    assert ended.returncode == 2
    assert ended.stderr.startswith("error: standard input is no terminal")
    assert ended.stdout == ""
