"""`twin guard` from a shell."""

from __future__ import annotations

from time import monotonic

import pytest

from tests.cli.conftest import Invoke
from tests.processes import program
from twin.bridge import live
from twin.bridge.msgs import Twist

LONG_S = 100.0


def test_stop_release_and_status(endpoint: str, invoke: Invoke, monkeypatch: pytest.MonkeyPatch) -> None:
    with live.join((), listen=[endpoint]) as robot:
        use(robot, endpoint, invoke, monkeypatch)


def use(robot: live.LiveBus, endpoint: str, invoke: Invoke, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TWIN_CONNECT", endpoint)
    code, _, error = invoke("guard", "stop", "--timeout", 0.2)
    assert (code, error) == (
        1,
        "error: no guard has acknowledged the stop on /guard in 0.2 s: use the robot's own switch\n",
    )
    code, _, error = invoke("guard", "status", "--timeout", 0.2)
    assert (code, error) == (
        1,
        "error: no guard has told its state on /guard/status in 0.2 s; is `twin guard` running?\n",
    )
    assert invoke("guard", "release", "--timeout", 0.2)[0] == 1
    node = robot.bus.create_node("robot")
    told: list[float] = []
    node.create_subscription(Twist, "/cmd_vel", lambda message: told.append(message.linear.x), 100)
    with program("guard", "--connect", endpoint, "--robot", "diff_bot", "--max-turn", "2") as process:
        assert process.stdout is not None
        assert process.stdout.readline() == (
            "/guard guards /cmd_vel: at most 1 m/s, 2 rad/s, 1 m/s², 6 rad/s²; Ctrl-C ends it\n"
        )
        assert robot.spin(lambda: bool(told), LONG_S)
        wait = ("--timeout", LONG_S)
        until_s = monotonic() + LONG_S  # its first words are from before it has found the robot
        while "no robot" in invoke("guard", "status", *wait)[1] and monotonic() < until_s:
            pass
        assert invoke("guard", "status", *wait) == (0, "stopped by start\n", "")
        assert invoke("guard", "release", *wait) == (0, "released\n", "")
        assert invoke("guard", "status", *wait) == (0, "nobody commands\n", "")
        assert invoke("guard", "stop", *wait) == (0, "stopped; `twin guard release` lets it move again\n", "")
        assert invoke("guard", "status", *wait) == (0, "stopped by twin guard stop\n", "")


def test_a_robot_without_a_drive_is_told_of(invoke: Invoke) -> None:
    code, _, error = invoke("guard", "--robot", "no_such_robot")
    assert code == 2
    assert "no_such_robot" in error
