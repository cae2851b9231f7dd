"""Listening to a robot that somebody else drives."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from benchmarks.measures.calibration import START_NS, Driver, room
from twin.bridge.bags.recorder import Recorder, RecorderConfig
from twin.bridge.bags.topic_choice import TopicChoice
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import JointState, LaserScan, Odometry, Twist, new
from twin.bridge.topics import Publisher
from twin.bridge.wire.session import SessionConfig
from twin.errors import RecordingError
from twin.live.calibration.calibrate import calibrate, needed_topics
from twin.live.calibration.listening import PATIENCE_S, Listening
from twin.live.calibration.recorded import topics_of
from twin.live.perturbations import perturbed
from twin.live.plant import Plant

NAMES = topics_of("", "scan")
MESSAGES = {"joint_states": JointState, "odom": Odometry, "scan": LaserScan, "cmd_vel": Twist}


def listening(bus: Bus, folder: Path, names: dict[str, str] = NAMES, seconds: float = 60.0) -> Listening:
    config = RecorderConfig(topics=TopicChoice(topics=tuple(names.values())), use_sim_time=True)
    return Listening(bus, names, Recorder(bus, folder, config), seconds)


def test_a_robot_that_drives_already_is_listened_to_and_calibrated(tmp_path: Path) -> None:
    scenario, bag = room(tmp_path), tmp_path / "bag"
    names = needed_topics(scenario)
    assert {*NAMES.items()} <= {*names.items()}
    changed, error = perturbed(scenario, "wheel_radius=0.97,track=1.02,latency=80ms,clock_offset=0.4s")
    told = []
    with Plant(changed, error=error, network=SessionConfig(), pace=None, start_ns=START_NS) as robots:
        bus, world = robots.run.run.bus, robots.run.run.world
        Driver(bus, 11, 60.0)
        robots.advance(lambda: world.time_ns >= 7e9)
        with listening(bus, bag, names, seconds=16.0) as heard:

            def listen() -> bool:
                heard.update()
                if not told or told[-1] != heard.lacks:
                    told.append(heard.lacks)
                return heard.is_over

            robots.advance(listen)
            assert heard.heard_s == pytest.approx(16.0, abs=0.1)
            ends = [end for node in bus.nodes if node.name != "driver" for end in node.endpoints]
            assert [end for end in ends if isinstance(end, Publisher) and end.name == "/cmd_vel"] == []
    assert told[0].startswith("nothing came on ")
    assert any("has not driven" in words for words in told)
    assert told[-2:] == ["15 s are needed", ""]
    found = {each.name: each for each in calibrate(scenario, bag).estimates}
    assert found["track"].factor == pytest.approx(1.02, abs=3e-3)
    assert found["wheel_radius"].factor == pytest.approx(0.97, abs=3e-3)
    assert found["latency"].value == pytest.approx(0.08, abs=5e-3)


class Silence:
    """A graph on which only what a test says is said, and time passes when it says so."""

    def __init__(self, bus: Bus, clock: Clock, folder: Path) -> None:
        self._bus, self._clock, self._folder = bus, clock, folder
        self._node = bus.create_node("robot")
        self._publishers: dict[str, Any] = {}

    def listen(
        self, seconds: float, *said: str, names: dict[str, str] = NAMES, until: float = 2.0 * PATIENCE_S
    ) -> list[str]:
        """Say something once, and return what was lacking each second until the end."""
        lacks = []
        with listening(self._bus, self._folder, names, seconds) as heard:
            for key in said:
                self._publishers[key] = self._node.create_publisher(MESSAGES[key], f"/{key}", 10)
                self._publishers[key].publish(new(MESSAGES[key]))
            while not heard.is_over and len(lacks) < until:
                self._clock.now_ns += 1_000_000_000
                self._bus.spin()
                heard.update()
                lacks.append(heard.lacks)
        return lacks


@pytest.fixture
def silence(tmp_path: Path) -> Iterator[Silence]:
    clock = Clock()
    clock.now_ns = START_NS
    with Bus.open(clock) as bus:
        yield Silence(bus, clock, tmp_path / "bag")


@pytest.mark.parametrize(
    ("names", "said", "until", "says"),
    [
        (
            NAMES,
            (),
            40.0,
            "nothing came on /joint_states, /odom and /scan in 21 s; nobody publishes anything else",
        ),
        (
            topics_of("/bot", "scan"),
            ("joint_states", "odom", "scan"),
            40.0,
            "nothing came on /bot/joint_states, /bot/odom and /bot/scan in 21 s; "
            "did you mean '/joint_states'? Valid: /joint_states, /odom, /scan",
        ),
        (
            NAMES,
            ("joint_states", "odom", "cmd_vel"),
            40.0,
            "nothing came on /scan in 21 s; Valid: /cmd_vel, /joint_states, /odom",
        ),
        (
            NAMES,
            ("joint_states", "odom", "scan"),
            40.0,
            "nothing came on /cmd_vel in 31 s; Valid: /joint_states, /odom, /scan",
        ),
        (
            NAMES,
            ("joint_states", "odom", "cmd_vel"),
            3.0,
            "nothing came on /scan in 3 s; Valid: /cmd_vel, /joint_states, /odom",
        ),
    ],
    ids=["nobody", "another robot", "no scans", "no commands", "interrupted"],
)
def test_who_says_too_little_is_named_with_what_there_is(
    silence: Silence, names: dict[str, str], said: tuple[str, ...], until: float, says: str
) -> None:
    with pytest.raises(RecordingError) as told:
        silence.listen(30.0, *said, names=names, until=until)
    assert str(told.value) == says


def test_what_is_lacking_is_told_while_it_is(silence: Silence) -> None:
    lacks = silence.listen(5.0, "joint_states", "odom", "scan", "cmd_vel")
    assert lacks[0].startswith("the robot has not driven, turned left, turned right or changed its speed")
    assert lacks[-1] == "the robot is silent"
    assert len(lacks) == 6
