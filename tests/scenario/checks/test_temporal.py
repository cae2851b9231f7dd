"""Checks in the language of formulas: what they mean on hand-made observations, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from tests.scenario.checks.test_checks import at, bot
from twin.bridge.types import get
from twin.errors import PluginError, ScenarioError
from twin.geometry import Pose2
from twin.scenario.checks import Check, CheckEntry, CheckResult
from twin.scenario.observation import CheckContext, Observation, Zone
from twin.scenario.schema import load

ODOM, TEXT = "nav_msgs/msg/Odometry", "std_msgs/msg/String"
CONTEXT = CheckContext(
    robots=("bot",),
    zones={"dock": Zone(centre=Pose2(5.0, 0.0, 0.0), size=(1.0, 1.0))},
    topics=lambda: {"/odom": ODOM, "/scan": "sensor_msgs/msg/LaserScan", "/mode": TEXT},
)


def made(entry: dict[str, Any]) -> Check:
    return CheckEntry.model_validate(entry).build(CONTEXT)


def fold(entry: dict[str, Any], observations: list[Observation]) -> CheckResult:
    check = made(entry)
    for observation in observations:
        check.observe(observation)
    return check.result()


def driving(*speeds: float) -> list[Observation]:
    """Return observations a second apart."""
    return [at(t, robots=bot(x=float(t), speed=speed)) for t, speed in enumerate(speeds)]


def test_a_verdict_has_the_margin_the_worst_moment_and_what_it_was_then() -> None:
    result = fold({"always": {"signal": "speed", "below": "3.6 km/h"}}, driving(0.0, 0.8, 0.9, 0.5))
    assert (result.name, result.passed) == ("always(speed < 3.6 km/h)", True)
    assert (result.value, result.limit, result.unit) == (0.9, 1.0, "m/s")
    assert (result.margin, result.worst_s, result.at_s) == (pytest.approx(0.1), 2.0, 3.0)


@pytest.mark.parametrize(
    ("kind", "entry", "name"),
    [
        ("always", {"signal": "speed", "below": 2}, "always(speed < 2)"),
        ("always", {"signal": "speed", "below": 2, "label": "slow enough"}, "slow enough"),
        ("finally", {"that": "speed < 2", "label": "slow in the end"}, "slow in the end"),
        ("formula", {"that": "never speed > 2", "label": "never fast"}, "never fast"),
        ("reaches", {"x": 0, "y": 0, "label": "is there"}, "is there"),
    ],
)
def test_the_verdict_calls_a_check_by_its_label(kind: str, entry: dict[str, Any], name: str) -> None:
    result = fold({kind: entry}, driving(0.0, 0.5))
    assert (result.name, result.passed) == (name, True)


def test_a_failure_tells_the_worst_moment_and_is_decided_at_the_first() -> None:
    result = fold({"always": "speed < 1"}, driving(0.0, 1.25, 1.5, 0.5))
    assert (result.passed, result.margin, result.worst_s) == (False, -0.5, 2.0)
    assert result.at_s == 1.0
    assert result.reason == "speed was 1.5 m/s at 2.00 s"


def test_at_its_limit_a_check_holds_if_the_limit_is_allowed() -> None:
    run = driving(0.0, 1.0)
    for key, passed in (("below", False), ("at_most", True)):
        result = fold({"always": {"signal": "speed", key: 1.0}}, run)
        assert (result.passed, result.margin) == (passed, 0.0)


@pytest.mark.parametrize(
    ("entry", "passed", "margin"),
    [
        ({"never": "speed > 1"}, False, -1.0),
        ({"never": {"signal": "speed", "above": 1, "before": "1 s"}}, True, 0.5),
        ({"always": {"signal": "speed", "at_least": 0.5, "after": 1, "before": 2}}, True, 0.0),
        ({"always": {"signal": "speed", "within": [0, 1.5]}}, False, -0.5),
        ({"eventually": {"signal": "speed", "above": 1}}, True, 1.0),
        ({"eventually": {"signal": "speed", "above": 1, "before": "1 s"}}, False, -0.5),
        ({"eventually": {"all": ["speed > 1", {"signal": "x", "below": 1}]}}, False, -0.5),
        ({"eventually": {"any": ["speed > 9", {"signal": "x", "below": 1}]}}, True, 1.0),
        ({"until": {"first": "speed < 1", "then": "x >= 2"}}, True, 0.0),
        ({"until": {"first": "speed < 1", "then": "x >= 3"}}, False, -1.0),
        ({"within": {"time": "1 s", "of": "speed > 1", "then": "x > 2.5"}}, True, 0.5),
        ({"within": {"time": "0.5 s", "of": "speed > 1", "then": "x > 2.5"}}, False, -0.5),
        ({"reaches": {"x": "2 m", "y": 1, "tolerance": "1.5 m"}}, True, 0.5),
        ({"reaches": {"x": 2, "y": 0, "yaw": "90 deg"}}, False, math.radians(-80.0)),
        ({"reaches": {"zone": "dock", "tolerance": "2 m"}}, True, 0.5),
        ({"formula": "always[0, 1] speed < 1 and eventually speed > 1"}, True, 0.5),
        ({"formula": "eventually always speed < 0.3"}, True, 0.05),
        ({"finally": {"signal": "speed", "below": 0.3}}, True, 0.05),
        ({"formula": "finally x > 9"}, False, -6.0),
        ({"formula": "always(speed > 1 implies not x > 2.5)"}, True, 0.5),
        ({"formula": "always[0, 2) speed < 1"}, True, 0.5),
        ({"formula": "always[0, 2] speed < 1"}, False, -1.0),
    ],
)
def test_what_each_kind_means(entry: dict[str, Any], passed: bool, margin: float) -> None:
    result = fold(entry, driving(0.0, 0.5, 2.0, 0.25))
    assert (result.passed, result.margin) == (passed, pytest.approx(margin)), result


def test_texts_and_truth_values_have_no_margin() -> None:
    run = [at(0, mission_state="driving"), at(1, mission_state="done", mission_done=True)]
    result = fold({"eventually": "mission_state == 'done'"}, run)
    assert (result.passed, result.margin, result.value, result.worst_s) == (True, None, None, 1.0)
    assert fold({"eventually": "mission_done"}, run).passed
    assert fold({"always": {"signal": "mission_state", "differs_from": "driving"}}, run).reason == (
        "mission_state was 'driving' at 0.00 s"
    )


def test_topics_are_read_as_their_messages_say() -> None:
    check = made({"eventually": "norm(/odom.twist.twist.linear) > 4 and /odom.pose.covariance[7] > 0"})
    read = dict(check.topics.items())
    odometry = _odometry(3.0, 4.0)
    values = {name: reader.read(odometry) for name, reader in read.items()}
    assert values == {"norm(/odom.twist.twist.linear)": 5.0, "/odom.pose.covariance[7]": 2.0}
    for t in (0, 1):
        check.observe(at(t, robots=bot()))
        for name, value in values.items():
            check.take(name, t * 10**9 + 5, value)
    result = check.result()
    assert (result.passed, result.margin, result.worst_s) == (True, 1.0, pytest.approx(5e-9))


def _odometry(x: float, y: float) -> Any:
    from twin.bridge.types.default_values import new

    message = new(get(ODOM))
    message.twist.twist.linear.x, message.twist.twist.linear.y = x, y
    message.pose.covariance[7] = 2.0
    return message


def test_single_precision_is_read_as_it_is_sent() -> None:
    import numpy as np

    from twin.bridge.types.default_values import new

    scan = new(get("sensor_msgs/msg/LaserScan"))
    scan.ranges = np.array([0.1, math.nan, 0.3], dtype=np.float32)
    scan.angle_min = 0.1
    read = made({"always": "min(/scan.ranges) > 0 and /scan.ranges[5] > 0 and /scan.angle_min > 0"}).topics
    assert [reader.read(scan) for reader in read.values()] == [np.float32(0.1), None, np.float32(0.1)]


def test_nothing_to_look_at_fails() -> None:
    reasons = {
        "always": "/odom.twist.twist.linear.x > 1",
        "never": {"signal": "localisation_error", "above": "1 m"},
        "eventually": {"signal": "speed", "below": 1, "after": "9 s"},
    }
    texts = [fold({kind: entry}, driving(0.0, 1.0)).reason for kind, entry in reasons.items()]
    assert texts == [
        "nothing to look at: there was no /odom.twist.twist.linear.x",
        "nothing to look at: there was no localisation_error",
        "nothing to look at: the run ended before 9 s",
    ]
    assert fold({"always": "speed < 1"}, []).reason == "the run made no step"


def test_what_is_decided_is_known_before_the_end() -> None:
    check = made({"eventually": {"signal": "speed", "above": 1, "before": "2 s"}})
    seen = []
    for observation in driving(0.0, 0.5, 1.5, 0.0, 0.0):
        check.observe(observation)
        seen.append(check.decided)
    assert seen == [None, None, True, True, True]


@pytest.mark.parametrize(
    "entry",
    [
        {"always": {"signal": "speed", "below": 0.97, "after": "10 s", "before": "150 s"}},
        {"eventually": {"signal": "speed", "above": 0.9999, "before": "120 s"}},
        {"formula": "always (speed > 0.9 implies eventually[0, 20] norm(/odom.twist.twist.linear) > 4.9)"},
        {"formula": "/odom.twist.twist.linear.x > 1 until speed > 0.5"},
    ],
)
def test_what_is_judged_together_is_judged_as_one_by_one(entry: dict[str, Any]) -> None:
    together, one_by_one = made(entry), made(entry)
    for t, observation in enumerate(driving(*(math.sin(0.1 * t) for t in range(200)))):
        for check in (together, one_by_one):
            check.observe(observation)
            for topic in check.topics:
                check.take(topic, t * 10**9 + 7, 5.0 * abs(math.cos(0.07 * t)))
        assert one_by_one.decided in (None, True, False), "asking judges what waits"
    assert together.result() == one_by_one.result()


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        (
            "always: {signal: clerance, above: 5 cm}",
            "signal: there is no signal 'clerance'; did you mean 'clearance'",
        ),
        (
            "always: {signal: clearance, above: 5 kg}",
            "above: the limit of clearance must have a unit of length",
        ),
        (
            "always: {signal: clearance, abov: 5 cm}",
            "unknown key 'abov' in checks.0.always; did you mean 'above'",
        ),
        ("always: {signal: mission_state, above: 3}", "above: mission_state is a text"),
        ("always: {signal: clearance}", "clearance is a number; compare it: clearance > 0"),
        ("always: {above: 3}", "must have exactly one of the keys signal, that, all, any"),
        ("always: {that: speed > 1, above: 3}", "above needs a signal"),
        (
            "always: {that: speed > 1, after: 2, before: 1 s}",
            r"before \(1 s\) must not be less than after \(2 s\)",
        ),
        ('formula: "always[0, 60](speed > 1"', r"(?<=:5: )at character 24: the end instead of \)"),
        (
            'formula: "alway speed > 1"',
            "at character 1 .*'alway' instead of an operator.*did you mean 'always'",
        ),
        (
            'formula: "always[5, 1] speed > 1"',
            "a window must begin at 0 or later, and not end before it begins",
        ),
        ("always: {signal: speed, within: [2, 1]}", "within takes the least value first"),
        ("always: yaw within [20 deg, 0.1]", "at character 1 .*within takes the least value first"),
        ("reaches: {zone: dock}", "zone 'dock', which the arena lacks; there are none"),
        ('formula: "distance_to(1 m) > 2"', r"distance_to takes \(x, y\), not \(1 m\)"),
        ('formula: "distance_to(1 m, 2 kg) > 2"', "y of distance_to must have a unit of length"),
        ('formula: "speed % 3"', "begins no signal, number or operator"),
        (f'formula: "{"(" * 99}speed > 1"', "nested too deeply"),
        ('formula: "mid(/scan.ranges) > 1"', "there is no function 'mid' of a topic; did you mean 'min'"),
        ("reaches: {x: 3}", "must have either the keys x and y, or zone"),
        ("until: {first: speed > 1}", "missing key 'then' in checks.0.until"),
        ("never: {robot: bot, that: speed > 1}", "unknown robot 'bot'; did you mean 'diff_bot'"),
        (
            "always: /odm.twist.twist.linear.x > 1",
            "no node of the run has the topic '/odm'; did you mean '/odom'",
        ),
        ("always: /odom.twist.twist.linear.w > 1", "Vector3 has no field 'w'.*Valid: x, y, z"),
        (
            "always: /odom.twist.twist > 1",
            "'twist' is geometry_msgs/msg/Twist, not one value; valid: linear, angular",
        ),
        (
            "always: /odom.pose.covariance > 1",
            r"not one value; write \[0\], or min, max, mean, norm, length around it",
        ),
        (
            "always: /odom.child_frame_id > 1",
            "/odom.child_frame_id is a text, and cannot be compared by > 1.0",
        ),
        ("always: mean(/odom.child_frame_id) > 1", r"mean\(\) is for arrays of numbers, not string"),
        ("always: other.speed > 1", "names the robot 'other', which is not there; valid: diff_bot"),
        ("always: distance_to_zone(dock) < 1", "names the zone 'dock', which the arena lacks"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(entry: str, message: str, tmp_path: Path) -> None:
    from twin.runtime import run

    file = tmp_path / "wrong.yaml"
    file.write_text(f"name: wrong\nduration: 1 s\nrobots: [model: diff_bot]\nchecks:\n  - {entry}\n")
    with pytest.raises(ScenarioError, match=rf"wrong.yaml:5: .*{message}"):
        run(load(file), record=False)


WOBBLE = """
from twin.scenario.signals import RobotSignal

class Wobble(RobotSignal):
    unit = "rad/s"

    def of(self, robot, time_s):
        return {value}
"""


@pytest.mark.parametrize(
    ("value", "entry", "said"),
    [
        ("0.25", "below: 20 deg/s", None),
        ("1 / 0", "below: 1", "signal 'wobble.py:Wobble' .*ZeroDivisionError: division by zero"),
        ("'fast'", "below: 1", "signal 'wobble.py:Wobble' returns 'fast'; it must be a float, or None"),
        ("0.25", "below: 3 kg", "below: the limit of wobble.py:Wobble must have a unit of turn rate"),
    ],
)
def test_a_signal_of_the_users_own(value: str, entry: str, said: str | None, tmp_path: Path) -> None:
    from twin.runtime import run

    (tmp_path / "wobble.py").write_text(WOBBLE.replace("{value}", value), encoding="utf-8")
    file = tmp_path / "wobbles.yaml"
    check = f'always: {{signal: "wobble.py:Wobble", {entry}}}'
    file.write_text(f"name: wobbles\nduration: 1 s\nrobots: [model: diff_bot]\nchecks: [{check}]\n")
    if said is not None:
        with pytest.raises((PluginError, ScenarioError), match=said):
            run(load(file, execute=True), record=False)
        return
    (result,) = run(load(file, execute=True), record=False).checks
    assert (result.passed, result.value, result.unit) == (True, 0.25, "rad/s")
    assert result.margin == pytest.approx(math.radians(20.0) - 0.25)
    assert load(file).checks[0].kind == "always", "it can be read without running the file"
