"""Virtual robots beside physical ones, as bags have them; on live graphs: `test_live_mirror.py`."""

from __future__ import annotations

import bisect
import csv
import json
import math
import re
from pathlib import Path
from typing import Any

import pytest

from twin.bridge.msgs import Odometry, TFMessage, TransformStamped, new
from twin.bridge.wire.session import SessionConfig
from twin.errors import RecordingError
from twin.geometry import Pose2, wrap_angle
from twin.live.mirror.bag_source import BagSource
from twin.live.mirror.follower import Difference
from twin.live.mirror.listening import past_statuses
from twin.live.mirror.mirror import Mirror
from twin.live.perturbations import perturbed
from twin.live.plant import Plant
from twin.recording.read_back import read as read_recording
from twin.scenario.schema import Scenario, load

START_NS = 1_700_000_000_000_000_000
PERTURBED = "latency=80ms,loss=2%,clock_offset=0.4s,clock_drift=50ppm"
SECONDS = 8.0


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load("diff_bot_figure8")


@pytest.fixture(scope="module")
def recorded(scenario: Scenario, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with `bag` and `truth.csv` of a robot that drives by itself."""
    folder = tmp_path_factory.mktemp("robot")
    changed, error = perturbed(scenario, PERTURBED)
    with Plant(
        changed,
        error=error,
        network=SessionConfig(),
        autonomy=True,
        pace=None,
        truth=folder / "truth.csv",
        bag=folder / "bag",
        start_ns=START_NS,
    ) as robots:
        world = robots.run.run.world
        robots.advance(lambda: world.time_ns >= SECONDS * 1e9)
    return folder


class Followed:
    """What a mirror did with a bag."""

    def __init__(self, scenario: Scenario, path: Path, **options: Any) -> None:
        self.poses: list[tuple[int, Pose2]] = []
        self.differences: list[Difference] = []
        with Mirror(scenario, BagSource(path), **options) as mirror:
            (robot,) = mirror.robots
            self.world = mirror.run.run.world

            def note() -> bool:
                self.poses.append((mirror.clock.now_ns, self.world.pose(robot.stack.handle.base).to_pose2()))
                if robot.difference is not None and robot.difference not in self.differences[-1:]:
                    self.differences.append(robot.difference)
                return False

            mirror.advance(note)
            self.events = robot.events
            self.judgement = mirror.statuses()[0].judgement
            self.report = robot.divergence.monitor.report()
            self.hashes = mirror.run.digest.stream


@pytest.fixture(scope="module")
def followed(scenario: Scenario, recorded: Path) -> Followed:
    return Followed(scenario, recorded / "bag")


def truths(folder: Path) -> list[tuple[int, Pose2]]:
    with (folder / "truth.csv").open() as file:
        rows = list(csv.DictReader(file))
    return [(int(r["stamp_ns"]), Pose2(float(r["x"]), float(r["y"]), float(r["yaw"]))) for r in rows]


def errors(poses: list[tuple[int, Pose2]], truth: list[tuple[int, Pose2]]) -> list[tuple[float, float]]:
    """Return how far off poses are [m, rad], where there is a truth of nearly the same time."""
    stamps = [stamp for stamp, _ in truth]
    found = []
    for stamp, pose in poses:
        i = bisect.bisect_left(stamps, stamp)
        if 0 < i < len(stamps):
            near = truth[i][1]
            found.append((pose.distance(near), abs(wrap_angle(pose.yaw - near.yaw))))
    return found


def test_it_is_where_the_physical_robot_truly_is(followed: Followed, recorded: Path) -> None:
    found = errors(followed.poses, truths(recorded))
    assert len(found) > 350
    assert max(position for position, _ in found) < 0.05
    assert max(yaw for _, yaw in found) < math.radians(3.0)
    assert max(math.hypot(truth.x, truth.y) for _, truth in truths(recorded)) > 0.4, "it must have driven"


def test_a_bag_gives_the_same_divergence_twice(
    followed: Followed, scenario: Scenario, recorded: Path
) -> None:
    again = Followed(scenario, recorded / "bag")
    assert len(followed.differences) > 350
    assert again.differences == followed.differences
    assert again.poses == followed.poses
    assert again.report == followed.report


def test_each_series_is_summed_up_and_a_delay_and_some_loss_are_no_alarm(followed: Followed) -> None:
    report = followed.report
    assert report.alarms == ()
    assert {"position", "yaw", "prediction", "scan", "delay"} <= report.series.keys()
    assert report.series["position"].count >= len(followed.differences)
    assert report.series["scan"].p95 < 0.02
    assert json.loads(json.dumps(report.to_dict()))["alarm_count"] == 0


def test_what_is_no_live_robot_is_no_twin(followed: Followed) -> None:
    assert followed.judgement.label == "shadow"
    assert "a bag obeys no commands" in followed.judgement.why


def test_it_is_not_put_elsewhere_while_it_follows(followed: Followed) -> None:
    steps = [a[1].distance(b[1]) for a, b in zip(followed.poses, followed.poses[1:], strict=False)]
    assert [event.what for event in followed.events] == []
    assert max(steps) < 0.02 * (0.5 + 0.5)  # what it drives, and what corrections may add, in 20 ms


def test_a_bag_of_a_mirror_is_mirrored_again(
    followed: Followed, scenario: Scenario, recorded: Path, tmp_path: Path
) -> None:
    first = Followed(scenario, recorded / "bag", bag=tmp_path / "own")
    again = Followed(scenario, tmp_path / "own")
    ends = [{d.stamp_ns: d for d in run.differences} for run in (first, again)]
    common = sorted(set(ends[0]) & set(ends[1]))
    assert len(common) > 350
    assert max(abs(ends[0][s].position - ends[1][s].position) for s in common) < 0.005
    (then,) = past_statuses(tmp_path / "own", 4.0)
    assert then.judgement.label == "shadow"
    assert min(pose.distance(then.virtual) for _, pose in first.poses[190:210]) < 1e-4
    with pytest.raises(RecordingError, match=r"no mirror told of itself at 60 s; the bag is \d"):
        past_statuses(tmp_path / "own", 60.0)
    with pytest.raises(RecordingError, match="no mirror has told of itself there"):
        past_statuses(recorded / "bag", 1.0)


def test_what_may_go_on_for_months_keeps_nothing_of_each_second(followed: Followed) -> None:
    assert followed.hashes == []


def test_no_bag_is_refused_in_a_sentence(scenario: Scenario) -> None:
    with pytest.raises(RecordingError, match="none: cannot be read"):
        Followed(scenario, Path("none"))


def test_what_is_in_its_way_but_not_in_that_of_the_physical_robot_is_told_and_let_through(
    scenario: Scenario, recorded: Path
) -> None:
    truth = truths(recorded)
    there = truth[len(truth) // 3][1]
    box = {"name": "box", "pose": {"x": there.x, "y": there.y}, "size": [0.1, 0.1, 0.3]}
    blocked = load("diff_bot_figure8", {"world.obstacles": json.dumps([box])})
    followed = Followed(blocked, recorded / "bag")
    assert [event.what for event in followed.events] == ["model"]
    assert "box is in the way, but not in that of the physical robot" in followed.events[0].text
    assert max(position for position, _ in errors(followed.poses, truth)) < 0.1


def test_what_walks_in_the_scenario_does_not_walk_in_a_mirror(recorded: Path) -> None:
    walker = {"name": "walker", "pose": {"x": 3.0}, "size": [0.4, 0.4, 1.0], "route": [[3.0, 3.0]]}
    box = {"name": "box", "pose": {"x": 5.0}, "size": [0.4, 0.4, 1.0]}
    followed = Followed(
        load("diff_bot_figure8", {"world.obstacles": json.dumps([walker, box])}), recorded / "bag"
    )
    names = {body.name for body in (*followed.world.scene.statics, *followed.world.scene.placed)}
    assert "box" in names
    assert "walker" not in names


def test_a_recording_shows_both_robots_and_the_label_on_one_time_line(
    scenario: Scenario, recorded: Path, tmp_path: Path
) -> None:
    Followed(scenario, recorded / "bag", out=tmp_path)
    recording = read_recording(tmp_path / "diff_bot_figure8.rrd")
    for entity in ("/trails/diff_bot/odometry", "/trails/diff_bot/truth", "/estimate/diff_bot"):
        assert entity in recording.entities
    assert recording.table("/mission/label")["state"].to_pylist() == ["shadow"]
    *_, told = recording.table("/mirror/status")["text"].to_pylist()
    assert re.search(
        r"diff_bot  SHADOW\n  because .*\n  physical .*\n  virtual .*\n  difference ", told, re.S
    )
    _, apart = recording.scalars("/divergence/diff_bot/position")
    assert 0.0 < max(apart) < 0.05


def test_numbers_that_are_none_are_told_once_and_forbid_to_speak_of_a_twin(
    scenario: Scenario, recorded: Path
) -> None:
    with Mirror(scenario, BagSource(recorded / "bag")) as mirror:
        (robot,) = mirror.robots
        node = mirror.run.run.bus.create_node("broken")
        transforms, odometry = (
            node.create_publisher(TFMessage, "/tf"),
            node.create_publisher(Odometry, "/odom"),
        )
        bad = new(TransformStamped, child_frame_id=robot.stack.frames.base)
        bad.header.frame_id = robot.stack.frames.odom
        bad.transform.translation.x = math.nan
        worse = new(Odometry)
        worse.pose.pose.position.x = math.nan
        said = []

        def break_it() -> bool:
            if 2e9 < mirror.run.run.world.time_ns < 3e9:
                transforms.publish(TFMessage(transforms=[bad]))
                odometry.publish(worse)
            said.extend(mirror.statuses()[0].judgement.why)
            return mirror.run.run.world.time_ns > 4e9

        mirror.advance(break_it)
        told = [event.what for event in robot.events]
        assert told.count("values") == 1
        assert any("invalid data" in why for why in said)
        assert robot.follower.resets == 0
        assert robot.difference is not None
        assert robot.difference.position < 0.05
