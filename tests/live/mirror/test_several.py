"""Two robots, each by a clock of its own, beside one mirror."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.live.beside import Beside, plant
from twin.bridge.msgs import Path as WayMsg
from twin.bridge.msgs import PoseStamped, TFMessage, TransformStamped, Twist, header, new, ns
from twin.live.mirror.followed_clock import FollowedClock
from twin.live.mirror.mirror import Mirror
from twin.live.mirror.robot_clocks import RobotClocks
from twin.live.one_robot import one_robot
from twin.scenario.schema import Scenario, load

SCENARIO = """
name: two
seed: 1
duration: 20 s
robots:
  - {name: left, model: diff_bot, pose: {y: 1.5}}
  - {name: right, model: diff_bot, pose: {y: -1.5}}
mission:
  type: velocity_profile
  robot: right
  steps: [{duration: 100 s, linear: 0.25 m/s, angular: -20 deg/s}]
checks: [{no_collision: }]
"""
SECOND = 1_000_000_000
PERTURBED = {"left": "clock_offset=0.2s,loss=30%", "right": "clock_offset=-0.2s"}


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    file = tmp_path_factory.mktemp("scenario") / "two.yaml"
    file.write_text(SCENARIO, encoding="utf-8")
    return load(file)


class Pair:
    """A mirror of both; each has a computer of its own, where the other one is not."""

    def __init__(self, scenario: Scenario) -> None:
        self.plants = {
            name: plant(one_robot(scenario, name), perturb, is_one_of_several=True, autonomy=True)
            for name, perturb in PERTURBED.items()
        }
        self.cable = Beside()
        self.mirror = Mirror(scenario, self.cable)
        self.robots = {robot.stack.name: robot for robot in self.mirror.robots}
        self.errors: dict[str, float] = {}
        """Largest distance of a virtual robot from where the physical one truly is [m]."""

    def start(self, name: str) -> None:
        self.cable.start(self.plants[name])

    def go_on(self, seconds: float) -> None:
        world = self.mirror.run.run.world
        end_ns = world.time_ns + round(seconds * 1e9)
        self.mirror.advance(lambda: self._note() or world.time_ns >= end_ns)

    def labels(self) -> dict[str, str]:
        return {status.robot: status.judgement.label for status in self.mirror.statuses()}

    def alarms(self) -> dict[str, list[str]]:
        return {
            name: [alarm.cause for alarm in robot.divergence.monitor.alarms.all]
            for name, robot in self.robots.items()
        }

    def _note(self) -> bool:
        for name, robots in self.plants.items():
            if robots in self.cable.plants:
                world, mirrored = robots.run.run.world, self.mirror.run.run.world
                truth = world.pose(world.robots[name].base).to_pose2()
                here = mirrored.pose(mirrored.robots[name].base).to_pose2()
                self.errors[name] = max(self.errors.get(name, 0.0), truth.distance(here))
        return False


@pytest.fixture
def pair(scenario: Scenario) -> Iterator[Pair]:
    made = Pair(scenario)
    with made.mirror:
        yield made


def test_each_is_followed_by_its_own_clock_and_a_missing_one_is_a_model_alone(pair: Pair) -> None:
    pair.start("right")
    pair.go_on(4.0)
    assert pair.labels() == {"left": "model", "right": "shadow"}
    pair.start("left")
    pair.go_on(4.0)
    assert pair.labels() == {"left": "shadow", "right": "shadow"}
    assert max(pair.errors.values()) < 0.05, pair.errors
    ages = [status.evidence.age_s for status in pair.mirror.statuses()]
    assert max(ages) < 0.1, "seen by their own clocks, neither is late"
    pair.cable.kill(pair.plants["left"])
    pair.go_on(6.0)
    assert pair.labels() == {"left": "model", "right": "shadow"}
    assert pair.alarms() == {"left": ["lossy link", "silent robot"], "right": []}
    assert [event.what for event in pair.robots["right"].events] == []
    assert pair.errors["right"] < 0.05


def test_every_time_in_what_a_robot_says_is_of_the_mirrors_clock_and_nothing_else_changes() -> None:
    mirror = FollowedClock(1000 * SECOND)
    clocks = RobotClocks(mirror, {"left": "/left", "right": "/right"})
    (met,) = clocks.follow("left", 0, 4600 * SECOND, 0)
    assert (met.what, met.robot, met.set_by_ns) == ("met", "left", 3600 * SECOND)
    way = new(WayMsg, header=header(4601 * SECOND, "map"))
    way.poses = [new(PoseStamped, header=header(time_ns, "map")) for time_ns in (4602 * SECOND, 0)]
    clocks.stamp_anew("/left/plan", way)
    assert [ns(each.header.stamp) for each in (way, *way.poses)] == [1001 * SECOND, 1002 * SECOND, 0]
    tree = TFMessage(transforms=[new(TransformStamped, header=header(4601 * SECOND, "odom"))])
    for topic, expected in (("/right/tf", 4601), ("/tf", 4601), ("/leftover/tf", 4601), ("/left/tf", 1001)):
        clocks.stamp_anew(topic, tree)
        assert ns(tree.transforms[0].header.stamp) == expected * SECOND, topic
    clocks.stamp_anew("/left/cmd_vel", new(Twist))
    assert clocks.follow("left", 0, 4600 * SECOND + 10_000_000, 0) == [], "that is slewed"
    (was_set,) = clocks.follow("left", 0, 4000 * SECOND, 0)
    assert (was_set.what, was_set.set_by_ns) == ("clock", -600 * SECOND)
