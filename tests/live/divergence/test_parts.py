"""Series, alarms, innovations, scans, messages and events, each by itself."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from twin.geometry import Pose2
from twin.live.divergence.alarms import Alarms, Finding, Threshold
from twin.live.divergence.events import Edge, EventPairs
from twin.live.divergence.flow import Flow
from twin.live.divergence.innovation import Believed, NisWindow, nis
from twin.live.divergence.motion import Ratios
from twin.live.divergence.response import Responses
from twin.live.divergence.scans import Scan, compare
from twin.live.divergence.series import Series

SECOND = 1_000_000_000


def test_a_series_is_summed_up_in_constant_memory() -> None:
    rng = np.random.default_rng(0)
    values = rng.normal(scale=0.02, size=5000)
    series = Series()
    for value in values:
        series.add(float(value))
    series.add(math.nan)
    found = series.summary()
    assert found is not None
    assert found.count == 5000
    assert found.rmse == pytest.approx(np.sqrt(np.mean(values**2)))
    assert found.p50 == pytest.approx(np.quantile(abs(values), 0.5), rel=0.04)
    assert found.p95 == pytest.approx(np.quantile(abs(values), 0.95), rel=0.04)
    assert found.max == abs(values).max()
    assert Series().summary() is None


def test_an_alarm_begins_when_it_has_lasted_and_ends_below_the_lower_threshold() -> None:
    alarms = Alarms({"heat": Threshold(on=2.0, off=1.0, for_s=1.0, until_s=1.0)})
    told = []
    for tick, value in enumerate([0, 3, 0, 3, 2.5, 2.5, 4, 1.5, 0.5, 1.5, 0.5, 0.5, 0.5]):
        found = Finding(cause="heat", number=value, text=f"{value} K")
        alarms.update(tick * SECOND // 2, [found])
        told.append(bool(alarms.active))
    # It was so for one tick; then for 1 s; 0.5 for a tick is no end.
    assert told == [False] * 5 + [True] * 6 + [False] * 2
    (alarm,) = alarms.all
    assert (alarm.begin_ns, alarm.end_ns) == (3 * SECOND // 2, 9 * SECOND // 2)
    assert (alarm.worst, alarm.text) == (4, "4 K")


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_the_normalised_innovation_is_as_large_as_covariances_say(scale: float) -> None:
    """Errors are as stated, or twice as large."""
    rng = np.random.default_rng(1)
    window, means, outside = NisWindow(size=20), [], 0
    P, Q = np.diag([4e-4, 1e-4, 1e-4]), np.diag([1e-4, 1e-5, 4e-5])
    for _ in range(600):
        before, moved = Pose2(1.0, 2.0, rng.uniform(-3, 3)), Pose2(0.5, 0.1, 0.4)
        odom = Pose2(-3.0, 1.0, rng.uniform(-3, 3))
        after = before @ moved
        drift = scale * rng.multivariate_normal(np.zeros(3), Q)
        # The covariance of odometry is stated in its own frame.
        seen = [
            Pose2(*(np.array(pose) + scale * rng.multivariate_normal(np.zeros(3), P)))
            for pose in (before, after)
        ]
        end = odom @ moved
        told = Pose2(end.x + drift[0], end.y + drift[1], end.yaw + drift[2])
        apart = end.y - odom.y, end.x - odom.x
        F = np.array([[1.0, 0.0, -apart[0]], [0.0, 1.0, apart[1]], [0.0, 0.0, 1.0]])
        start = np.diag([1e-2, 1e-2, 1e-3])
        window.add(
            nis(
                Believed(stamp_ns=0, pose=seen[0], covariance=P),
                Believed(stamp_ns=1, pose=seen[1], covariance=P),
                Believed(stamp_ns=0, pose=odom, covariance=start),
                Believed(stamp_ns=1, pose=told, covariance=F @ start @ F.T + Q),
            )
        )
        assert window.mean is not None
        assert window.bounds is not None
        means.append(window.mean)
        outside += not window.bounds[0] <= window.mean <= window.bounds[1]
    assert np.mean(means) == pytest.approx(3.0 * scale**2, rel=0.15)
    assert (outside / 600 < 0.12) == (scale == 1.0)


def room(x: float, y: float, yaw: float, *, box: bool = False) -> Scan:
    """Return what a lidar sees in a room of 8 m by 6 m, with a post or not."""
    angles = -math.pi + 2.0 * math.pi / 360 * np.arange(360) + yaw
    with np.errstate(divide="ignore"):
        walls = [(4.0 - x) / np.cos(angles), (-4.0 - x) / np.cos(angles)]
        walls += [(3.0 - y) / np.sin(angles), (-3.0 - y) / np.sin(angles)]
    ranges = np.min([np.where(wall > 0.0, wall, np.inf) for wall in walls], axis=0)
    if box:
        bearing = np.arctan2(1.0 - y, 2.0 - x)
        near = np.abs((angles - bearing + math.pi) % (2.0 * math.pi) - math.pi) < 0.12
        ranges = np.where(near, math.hypot(2.0 - x, 1.0 - y), ranges)
    return Scan(
        stamp_ns=0, angle_min=-math.pi, angle_increment=2.0 * math.pi / 360, range_max=20.0, ranges=ranges
    )


def test_a_scan_is_explained_from_a_place_near_by_and_when_turned() -> None:
    seen = compare(room(0.0, 0.0, 0.0), room(0.05, 0.02, 0.3), Pose2(0.03, 0.0, 0.29))
    assert seen.explained == 1.0
    assert seen.residual < 0.05
    assert not seen.things


@pytest.mark.parametrize("increment", [1.0, -1.0])
@pytest.mark.parametrize("bias", [0.0, 0.3, -0.1])
def test_what_all_rays_measure_too_much_is_told_from_a_place_that_is_wrong(
    bias: float, increment: float
) -> None:
    expected, measured = room(0.0, 0.0, 0.0), room(0.2, 0.1, 0.05, box=True)
    order = slice(None) if increment > 0.0 else slice(None, None, -1)
    measured = replace(
        measured,
        angle_min=measured.angles[order][0],
        angle_increment=increment * measured.angle_increment,
        ranges=measured.ranges[order] + bias,
    )
    assert compare(expected, measured, Pose2(0.0, 0.0, 0.0)).offset == pytest.approx(bias, abs=0.03)


def test_a_lidar_that_sees_no_ray_and_its_opposite_tells_no_bias() -> None:
    expected = room(0.0, 0.0, 0.0)
    half = replace(expected, angle_min=-1.0, ranges=room(0.0, 0.0, math.pi - 1.0).ranges[:114] + 0.3)
    assert compare(expected, half, Pose2(0.0, 0.0, 0.0)).offset == 0.0


def test_what_is_there_and_what_is_gone_are_things_at_their_places() -> None:
    for expected, measured, kind in ((False, True, "more"), (True, False, "less")):
        seen = compare(room(0, 0, 0, box=expected), room(0, 0, 0, box=measured), Pose2(0.0, 0.0, 0.0))
        (thing,) = seen.things
        assert thing.kind == kind
        assert (thing.x, thing.y) == pytest.approx((2.0, 1.0), abs=0.1)
        assert thing.width == pytest.approx(0.4, abs=0.2)
        assert 0.9 < seen.explained < 0.99


def test_a_blind_scan_is_told_from_one_without_readings() -> None:
    nothing = room(0, 0, 0)
    for value, returned in ((np.inf, 0.0), (np.nan, 0.0)):
        blind = Scan(
            stamp_ns=0, angle_min=-math.pi, angle_increment=0.0175, range_max=20.0, ranges=np.full(360, value)
        )
        seen = compare(nothing, blind, Pose2(0.0, 0.0, 0.0))
        assert (seen.returned, seen.expected) == (returned, 1.0)
        assert (seen.longer > 0.9) == (value == np.inf)


def test_delay_loss_and_order_of_messages_are_measured() -> None:
    flow, rng = Flow(), np.random.default_rng(0)
    assert flow.report(0) is None
    for i in range(200):
        if rng.random() < 0.8:
            assert flow.take(i * SECOND // 50, i * SECOND // 50 + 80_000_000)
    assert not flow.take(0, 4 * SECOND)
    report = flow.report(5 * SECOND)
    assert report is not None
    assert report.age_s == pytest.approx(1.0)
    assert report.delay_s == pytest.approx(0.08)
    assert report.lost == pytest.approx(0.25, abs=0.1)
    assert report.repeated > 0.0


def test_events_are_paired_and_those_of_one_robot_only_are_told_once() -> None:
    pairs = EventPairs()
    assert pairs.take("stops", 10 * SECOND, physical=True) is None
    assert pairs.take("touches", 10 * SECOND, physical=False) is None
    found = pairs.take("stops", 10 * SECOND - 80_000_000, physical=False)
    assert found is not None
    assert found.late_s == pytest.approx(0.08)
    assert pairs.overdue(11 * SECOND) == []
    (only,) = pairs.overdue(20 * SECOND)
    assert (only.what, only.only, only.late_s) == ("touches", "virtual", None)
    assert pairs.overdue(30 * SECOND) == []


def test_an_edge_is_no_flicker() -> None:
    edge = Edge(0.5, 0.2, SECOND)
    values = [0.0, 0.6, 0.0, 0.6, 0.7, 0.6, 0.1, 0.3, 0.1, 0.1, 0.1]
    told = [edge.take(i * SECOND // 2, value) for i, value in enumerate(values)]
    # Above for a moment; then for a second, and below the lower threshold for one.
    assert [each for each in told if each is not None] == [(True, 3 * SECOND // 2), (False, 4 * SECOND)]


def test_a_ratio_forgives_a_bias_and_tells_how_sure_it_is() -> None:
    rng = np.random.default_rng(0)
    biased, plain = Ratios(200, 5.0, bias=0.01), Ratios(200, 5.0)
    for i in range(200):
        told = 0.5 if i % 4 else 0.0
        for ratios in (biased, plain):
            ratios.add(i, told, 0.98 * told + 0.006 + 0.001 * rng.normal())
    found, wrong = biased.ratio(0.001), plain.ratio(0.001)
    assert found is not None
    assert wrong is not None
    assert found.value == pytest.approx(0.98, abs=5.0 * found.stddev)
    assert found.stddev < 5e-4
    assert wrong.value > 0.985


@pytest.mark.parametrize("late_s", [0.0, 0.08, 0.35])
def test_how_late_and_how_much_wheels_answer_is_found(late_s: float) -> None:
    responses, rng = Responses(), np.random.default_rng(0)
    for i in range(500):
        t = i * 0.02
        responses.virtual(round(t * 1e9), 0.4 * math.sin(2.0 * t), 0.5 * math.cos(3.0 * t))
        t -= late_s
        noise = 0.01 * rng.normal()
        responses.physical(round(i * 0.02 * 1e9), 0.28 * math.sin(2.0 * t) + noise, 0.35 * math.cos(3.0 * t))
    found = responses.report()
    assert found.latency_s == pytest.approx(late_s, abs=0.01)
    assert found.ratio == pytest.approx(0.7, abs=0.03)


def test_an_alarm_lasts_as_long_by_a_clock_that_was_set() -> None:
    alarms = Alarms({"heat": Threshold(on=2.0, off=1.0, for_s=0.0, until_s=1.0)})
    alarms.update(5000 * SECOND, [Finding(cause="heat", number=3.0, text="")])
    alarms.clock_set(-4000 * SECOND)
    alarms.update(1000 * SECOND + SECOND // 2, [])
    assert alarms.active
    alarms.update(1001 * SECOND, [])
    assert not alarms.active
