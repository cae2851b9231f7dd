"""What happens to a robot is planted, and told by its name; how often the virtual robot is put elsewhere."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pytest

from tests.live.beside import Beside, plant
from twin.bridge.msgs import PoseWithCovarianceStamped, Twist, new
from twin.live.mirror.mirror import Mirror
from twin.live.plant import Plant
from twin.scenario.schema import Scenario, load

PAUSE_S = 9.0
"""After it, what happened is over."""


def scenario(faults: str = "[]") -> Scenario:
    """Return a robot in the warehouse that finds itself by its map, and drives as it is told."""
    return load(
        "warehouse_patrol",
        {
            "world.obstacles": "[]",
            "robots.0.start": "null",
            "robots.0.pose": "{x: -4.5, y: -1.0}",
            "faults": faults,
        },
    )


@dataclass
class Happening:
    """Something that is done to a robot, and what was told until the next one."""

    what: str
    at_s: float
    alarms: set[str] = field(default_factory=set)
    resets: int = 0
    label: str = ""
    """At the end."""


class Story:
    """A mirror that drives a robot in eights, or leaves it where it stands, and what was told of it."""

    def __init__(self, faults: str = "[]", perturb: str = "", *, drives: bool = True, **options: Any) -> None:
        self.robot = plant(scenario(faults), perturb)
        self.cable = Beside(self.robot, **options)
        self.happened: list[Happening] = [Happening("begins", 0.0)]
        self.mirror = Mirror(scenario(), self.cable, autonomy="localisation")
        (self.mirrored,) = self.mirror.robots
        self._world = self.mirror.run.run.world
        node = self.mirror.run.run.bus.create_node("operator")
        self._commands = node.create_publisher(Twist, "/cmd_vel")
        self._poses = node.create_publisher(PoseWithCovarianceStamped, "/initialpose")
        if drives:
            node.create_timer(50_000_000, self._drive)

    def go_on(self, seconds: float, until: Callable[[], bool] = lambda: False) -> None:
        """Go on for so long, at most."""
        end_ns = self._world.time_ns + round(seconds * 1e9)
        self.mirror.advance(lambda: self._note() or until() or self._world.time_ns >= end_ns)

    def happens(self, what: str) -> None:
        """Begin something."""
        self.happened.append(Happening(what, self.now_s))

    @property
    def now_s(self) -> float:
        """Since the beginning."""
        return self._world.time_ns * 1e-9

    @property
    def apart(self) -> float:
        """How far the virtual robot is from where the first one truly is [m]."""
        world = self.cable.plants[0].run.run.world
        (truth,) = (world.pose(robot.base).to_pose2() for robot in world.robots.values())
        return self.mirror.statuses()[0].virtual.distance(truth)

    def start_again(self, perturb: str, silent_s: float, faults: str = "[]") -> Plant:
        """Cut the robot's power, and start it a while later."""
        self.cable.kill(self.robot)
        self.go_on(silent_s)
        self.robot = plant(scenario(faults), perturb)
        self.cable.start(self.robot)
        return self.robot

    def tell_where_it_is(self, x: float, y: float) -> None:
        """Tell localisation, which believes it, where the robot is [m]."""
        told = new(PoseWithCovarianceStamped)
        told.header.frame_id = "map"
        told.pose.pose.position.x, told.pose.pose.position.y = x, y
        told.pose.covariance[[0, 7, 35]] = 0.01
        self._poses.publish(told)

    def _note(self) -> bool:
        now, events = self.happened[-1], self.mirrored.events
        while events:
            event = events.popleft()
            if event.what == "alarm" and not event.text.endswith(": over"):
                now.alarms.add(event.text.partition(":")[0])
            now.resets += event.what == "reset"
        now.label = self.mirror.statuses()[0].judgement.label
        doubts = self.mirrored.divergence.doubts
        assert not (doubts and now.label == "twin"), doubts
        return False

    def _drive(self) -> None:
        told = new(Twist)
        told.linear.x, told.angular.z = 0.25, 0.6 if self.now_s % 22.0 < 11.0 else -0.6
        self._commands.publish(told)


@pytest.mark.parametrize(
    "clock", [pytest.param("clock_offset=3600s", marks=pytest.mark.long), "clock_offset=-3600s"]
)
def test_a_robot_that_starts_again_is_told_of_and_put_where_it_is_once(clock: str) -> None:
    away = "[{kidnapping: {at: 3 s, to: {x: -6, y: 2, yaw: 150 deg}}}]"
    story = Story(away)
    with story.mirror:
        story.happens("kidnapped")
        story.go_on(13.0)
        story.happens("starts again")
        story.start_again(clock, 1.5)
        story.go_on(0.5)
        assert story.mirrored.divergence.doubts[0].startswith("robot restarted: odometry begins again, ")
        story.go_on(14.0)
        assert story.apart < 0.05
    _, kidnapped, again = story.happened
    assert (kidnapped.alarms, kidnapped.resets) == ({"kidnapped"}, 1)
    assert (again.alarms, again.resets, again.label) == ({"silent robot", "robot restarted"}, 1, "twin")


def test_a_robot_that_starts_again_far_from_where_localisation_has_odometry_begin_is_put_there_once() -> None:
    """It was carried away before, so odometry's frame is elsewhere; and silent for so long that it may be.

    When it is carried away again, nobody speaks of the start any more.
    """
    away = "[{kidnapping: {at: AT, to: {x: -6, y: 2, yaw: 150 deg}}}]"
    story = Story(away.replace("AT", "3 s"))
    with story.mirror:
        story.go_on(13.0)
        story.happens("starts again")
        story.start_again(f"clock_offset={story.now_s + 6.0}s", 6.0, away.replace("AT", "15 s"))
        story.go_on(14.0)
        assert story.apart < 0.05
        story.happens("is carried away")
        story.go_on(10.0)
    _, again, later = story.happened
    assert (again.alarms, again.resets, again.label) == ({"silent robot", "robot restarted"}, 1, "twin")
    assert (later.alarms, later.resets, later.label) == ({"kidnapped"}, 1, "twin")


@pytest.mark.parametrize("x", [-30.0, 4.0])
def test_localisation_that_scans_contradict_forbids_a_twin_and_finds_a_robot_that_stands(x: float) -> None:
    """A filter takes in no scan while a robot stands: it would stay where it was told to be, off the map."""
    story = Story(drives=False)
    with story.mirror:
        story.go_on(2.0)
        for _ in range(30):  # somebody insists
            story.tell_where_it_is(x, -1.0)
            story.go_on(0.2)
        (why,) = story.mirrored.divergence.doubts
        assert why.startswith(f"localisation lost: it finds the robot at ({x:.0f}.")
        assert why.endswith("which is not on the map") == (x == -30.0)
        assert why in story.mirror.statuses()[0].judgement.why
        story.go_on(12.0)
        assert not story.mirrored.divergence.doubts
        assert story.apart < 0.1


def test_a_robot_that_is_carried_away_while_it_stands_is_found() -> None:
    story = Story("[{kidnapping: {at: 3 s, to: {x: -6, y: 2, yaw: 150 deg}}}]", drives=False)
    with story.mirror:
        story.go_on(13.0)
        assert story.apart < 0.1
    (found,) = story.happened
    assert found.resets == 1


def test_a_robot_whose_clock_was_set_back_is_missed_when_it_falls_silent() -> None:
    story = Story()
    with story.mirror:
        story.go_on(2.0)
        story.start_again("clock_offset=-3600s", 0.1)
        story.go_on(8.0)
        assert story.mirror.statuses()[0].judgement.label == "twin"
        story.cable.is_cut = True
        story.go_on(0.6)
        assert story.mirror.statuses()[0].judgement.label == "shadow"
        story.go_on(5.0)
        assert story.mirror.statuses()[0].judgement.label == "model"


@pytest.mark.long
def test_what_happens_to_a_robot_for_a_while_is_told_by_its_name_alone_and_then_it_is_well_again() -> None:
    faults = """[
        {odometry_jump: {at: 4 s, distance: 1 m, yaw: 40 deg}},
        {lidar: {at: 14 s, duration: 3 s, kind: blind}},
    ]"""
    story = Story(faults)

    def no_numbers(topic: str, message: Any) -> None:
        if topic == "/odom":
            message.pose.pose.position.x = math.nan

    with story.mirror:
        for what, seconds in (("odometry jump", 13.5), ("blind lidar", 12.5)):
            story.happens(what)
            story.go_on(seconds)
        story.happens("silent robot")
        story.cable.is_cut = True
        story.go_on(2.0)
        story.cable.is_cut = False
        story.go_on(PAUSE_S)
        story.happens("invalid data")
        story.cable.alters = no_numbers
        story.go_on(1.0)
        story.cable.alters = lambda topic, message: None
        story.go_on(PAUSE_S)
        story.happens("duplicate robot")
        rival = plant(scenario())
        story.cable.start(rival)
        story.go_on(3.0)
        story.cable.kill(rival)
        story.go_on(PAUSE_S)
    for happened in story.happened[1:]:
        assert (happened.alarms, happened.resets, happened.label) == ({happened.what}, 0, "twin"), happened


@pytest.mark.long
@pytest.mark.parametrize(
    ("cause", "planted"),
    [
        ("lossy link", {"perturb": "loss=30%"}),
        ("late link", {"delay_s": 0.3}),
        ("late response", {"perturb": "latency=400ms"}),
        ("wheel radius", {"perturb": "wheel_radius=0.95"}),
        ("track", {"perturb": "track=1.05"}),
        ("commands not followed", {"faults": "[{flat_battery: {voltage: 0 %, at: 8 s}}]"}),
        ("wheel slip", {"faults": "[{wheel_slip: {joint: wheel_left_joint, factor: 0.02, at: 8 s}}]"}),
        ("lidar bias", {"faults": "[{bias: {sensor: scan, by: 0.3, at: 8 s}}]"}),
        ("lidar bias", {"faults": "[{bias: {sensor: scan, by: -0.1, at: 8 s}}]"}),
        ("obstacle of the model is gone", {"faults": "[{displacement: {name: pillar_west, by: {x: 30}}}]"}),
        ("obstacle not in the model", {"faults": "[{pallet: {pose: {x: -2.8, y: -1.0}, at: 8 s}}]"}),
    ],
)
def test_what_lasts_is_told_by_its_name_alone(cause: str, planted: dict[str, Any]) -> None:
    """Once the way is long enough to tell one of the wheels' faults from the other; or a robot rolls out."""
    story = Story(**planted)
    with story.mirror:
        story.go_on(30.0)
    (found,) = story.happened
    before = {"unknown"} if cause in ("wheel radius", "track", "commands not followed") else set()
    assert found.alarms - (before - {cause}) == {cause}
    assert found.resets == 0
