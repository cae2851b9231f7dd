"""Divergence of one pair of robots: series, alarms and their sum, from stamped data alone.

All stamps and times are of the physical robot's clock [ns]; nothing else is looked at, so data of a bag give
the same as they gave live.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from twin.geometry import Array, Pose2, wrap_angle
from twin.live.divergence.alarms import Alarm, Alarms
from twin.live.divergence.causes import THRESHOLDS, causes
from twin.live.divergence.events import Edge, EventPairs, Misalignment
from twin.live.divergence.evidence import Evidence, Fit, Jump, Lost, ScanEvidence
from twin.live.divergence.flow import Flow
from twin.live.divergence.histories import PoseHistory
from twin.live.divergence.innovation import Believed, NisWindow, nis
from twin.live.divergence.motion import Ratio, Ratios
from twin.live.divergence.response import Response, Responses
from twin.live.divergence.scans import Scan, ScanMatch, compare
from twin.live.divergence.series import Series, Summary
from twin.live.divergence.things import Places
from twin.navigation.scan_watch import RepeatedScan

STEP_NS = 200_000_000
"""Between two looks at the evidence."""
_RECENT_NS = 5_000_000_000
_SECOND_NS = 1_000_000_000
_TURN_NS = 500_000_000
"""Turns are compared over so much time."""
_STRETCHES = 60
_STRETCH = (0.6, 1.2)
"""Of motion, by odometry, over which localisation is compared with it [m], [rad]."""
_SETTLING_NS = 5_000_000_000
"""So long after a robot was elsewhere, localisation may still be finding it."""
_FASTEST, _FASTEST_TURN = 5.0, 10.0
"""No robot of this kind is faster [m/s], [rad/s]: what moved more has jumped."""
_LEAST_RETURNED = 0.1
"""Share of its rays without which a scan tells nothing."""
_JUMP, _JUMP_TURN = 0.25, 0.35
"""Beside that [m], [rad]."""
_PAIRED_NS = 60_000_000
"""Scans of the two lidars are compared that are so near in time."""
_WAITS_NS = 2_000_000_000
_SLIPPED, _TWISTED = 0.1, 0.04
"""Odd stretches are off by that [m], [rad]."""
_UNSURE, _CONTRARY, _UNSURE_RESIDUAL = 0.6, 0.05, 0.06
"""A robot is not where it is thought to be if less of a scan is explained, and rays of it end both before and
behind what is expected; or if what is explained differs by so much [m]. What stands before a lidar hides much
of it, but makes no ray longer."""
_LOST = 0.3
"""Nor is it if less of a scan than that is explained from there, whatever stands before the lidar."""
_BREAK = 0.3
"""So much less of a scan is explained than of the one before it: one of the two robots was moved."""
_START = 0.02
"""Odometry that begins is so near to where it begins [m], [rad]."""
_SILENT_NS = 300_000_000
"""A robot that starts again has said nothing for so long."""
_STILL = 1e-3
"""A robot whose wheels turn slower stands [m/s], [rad/s]."""


@dataclass(frozen=True, kw_only=True)
class Report:
    """All of a run, for a verdict."""

    series: dict[str, Summary]
    alarms: tuple[Alarm, ...]
    """The latest thousand."""
    alarm_count: int
    misaligned: dict[str, int]
    """Events that happened to one robot only."""

    def to_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        return asdict(self)


class DivergenceMonitor:
    """Takes what was heard of both robots, in any order between them; `step` judges it."""

    NAMES = ("position", "yaw", "prediction", "nis", "scan", "scan_residual", "event", "delay", "latency")
    """Series: metres, radians, metres, mean NIS, share of unexplained rays, metres, and seconds."""

    def __init__(self, told: Callable[[str, float], None] = lambda name, value: None) -> None:
        """Begin; `told` is called with each new value of a series."""
        self.series = {name: Series() for name in self.NAMES}
        self.alarms = Alarms(THRESHOLDS)
        self.publishers: int | None = None
        """How many publish the physical robot's odometry, if somebody counts."""
        self.clock_bound_s = 0.0
        """How well the robot's clock is known [s]."""
        self.evidence = Evidence()
        """Of the last step."""
        self.misaligned: dict[str, int] = {}
        self._told = told
        self._latest_odom: tuple[int | None, Pose2] | None = None
        """When it came, None if by another clock, and pose of the latest odometry."""
        self._begin()

    def clock_set(self, by_ns: int) -> None:
        """Begin anew, but for series and alarms: the robot's clock was set by so much [ns]."""
        self.alarms.clock_set(by_ns)
        if self._latest_odom is not None:
            self._latest_odom = None, self._latest_odom[1]
        self._begin()

    def _begin(self) -> None:
        self._flows = {"odometry": Flow(), "scans": Flow()}
        self._odom, self._virtual_odom, self._driven, self._virtual = (PoseHistory() for _ in range(4))
        self._responses, self._pairs, self._nis = Responses(), EventPairs(), NisWindow()
        self._moving = {side: Edge(0.05, 0.02, 300_000_000) for side in (True, False)}
        self._invalid: deque[int] = deque(maxlen=1000)
        self._jumps: deque[tuple[int, Pose2, bool]] = deque(maxlen=100)
        self._odom_count: deque[int] = deque(maxlen=1000)
        self._restarted: tuple[int, Pose2, bool] | None = None
        self._told_pose_ns: int | None = None
        self._jumped_ns: int | None = None
        self._stepped_ns: int | None = None
        self._response = Response(ratio=None, latency_s=None)
        self._begin_motion()
        self._begin_scans()

    def _begin_motion(self) -> None:
        self._distances, self._turns = Ratios(_STRETCHES, 3.0), Ratios(4 * _STRETCHES, 5.0, bias=0.01)
        self._begin_stretch()
        self._nominal_distances, self._nominal_turns = Ratios(_STRETCHES, 3.0), Ratios(_STRETCHES, 5.0)
        self._localised_turns = Ratios(_STRETCHES, 5.0)
        self._waiting: deque[Believed] = deque(maxlen=50)
        self._believed: Believed | None = None
        self._found_jump: tuple[int, Pose2] | None = None
        self._gyro: deque[tuple[int, float]] = deque(maxlen=2000)
        self._gyro_bias = 0.0
        self._gyro_from_ns: int | None = None
        self._standing: deque[tuple[int, float]] = deque(maxlen=20)

    def _begin_scans(self) -> None:
        self._scans: deque[tuple[Scan, Pose2]] = deque(maxlen=20)
        self._virtual_scans: deque[Scan] = deque(maxlen=40)
        self._matches: deque[ScanMatch] = deque(maxlen=60)
        self._places, self._repeated = Places(), RepeatedScan(5, 0.1)
        self._frozen = False
        self._broke_ns: int | None = None
        self._fit: Fit | None = None
        self._lost_ns: int | None = None
        self._unsure_ns: int | None = None
        self._correction: Pose2 | None = None

    # What is heard

    def odometry(
        self,
        stamp_ns: int,
        pose: Pose2,
        covariance: Array,
        speed: float,
        turn: float,
        now_ns: int,
        *,
        is_new: bool = False,
    ) -> None:
        """Take the physical robot's odometry, which came at `now_ns`.

        Args:
            stamp_ns: Of the message.
            pose: In the frame of odometry.
            covariance: ROS's, shape (36,).
            speed: Forwards [m/s].
            turn: [rad/s].
            now_ns: When it came.
            is_new: Whether somebody publishes it who never did, and nobody else does any more.
        """
        if not (all(map(math.isfinite, pose)) and math.isfinite(speed) and math.isfinite(turn)):
            self._flows["odometry"].take(stamp_ns, now_ns)
            self.invalid(now_ns)
            return
        newer = self._flows["odometry"].take(stamp_ns, now_ns)
        before = self._odom.latest
        self._odom_count.append(now_ns)
        stands = abs(speed) < _STILL and abs(turn) < _STILL
        begins = self._begins(now_ns, pose, is_new=is_new, stands=stands)
        last, self._latest_odom = self._latest_odom, (now_ns, pose)
        if last is not None and begins:
            self._jumped(stamp_ns, now_ns, last[1].inverse() @ pose, to_start=True)
        elif before is not None:
            elapsed = abs(stamp_ns - before.stamp_ns) * 1e-9
            step = before.pose.inverse() @ pose
            if (
                math.hypot(step.x, step.y) > _JUMP + _FASTEST * elapsed
                or abs(step.yaw) > _JUMP_TURN + _FASTEST_TURN * elapsed
            ):
                self._jumped(stamp_ns, now_ns, step, to_start=False)
            elif not newer:
                return
        self._odom.add(stamp_ns, pose, covariance)
        self._responses.physical(stamp_ns, speed, turn)
        self._move(stamp_ns, speed, turn, physical=True)

    def _begins(self, now_ns: int, pose: Pose2, *, is_new: bool, stands: bool) -> bool:
        """Return whether odometry begins again, somewhere else than it had come to.

        After a silence, or by another clock: at its start by one who did not publish it, or exactly there at
        rest.
        """
        if self._latest_odom is None:
            return False
        before_ns, last = self._latest_odom
        if before_ns is not None and 0 <= now_ns - before_ns < _SILENT_NS:
            return False
        step = last.inverse() @ pose
        if math.hypot(step.x, step.y) < _JUMP and abs(step.yaw) < _JUMP_TURN:
            return False
        away, turned = math.hypot(pose.x, pose.y), abs(pose.yaw)
        if is_new:
            return away < _JUMP and turned < _JUMP_TURN
        return stands and away < _START and turned < _START

    def _jumped(self, stamp_ns: int, now_ns: int, step: Pose2, *, to_start: bool) -> None:
        self._jumps.append((now_ns, step, to_start))
        if to_start:
            self._restarted = self._jumps[-1]
        self._jumped_ns = stamp_ns
        self._odom.clear()
        self._begin_motion()
        self._responses.clear()
        self._stepped_ns = None  # that is not put off

    def virtual_odometry(self, stamp_ns: int, pose: Pose2, speed: float, turn: float) -> None:
        """Take the virtual robot's odometry."""
        self._virtual_odom.add(stamp_ns, pose)
        self._responses.virtual(stamp_ns, speed, turn)
        self._move(stamp_ns, speed, turn, physical=False)

    def virtual_pose(self, stamp_ns: int, virtual: Pose2, driven: Pose2) -> None:
        """Take where the virtual robot is, and where it had driven without any correction."""
        self._virtual.add(stamp_ns, virtual)
        self._driven.add(stamp_ns, driven)

    def localised(self, stamp_ns: int, pose: Pose2, covariance: Array, now_ns: int) -> None:
        """Take where localisation finds the physical robot; covariance is ROS's, shape (36,)."""
        if not (all(map(math.isfinite, pose)) and np.all(np.isfinite(covariance))):
            self.invalid(now_ns)
            return
        self._waiting.append(Believed(stamp_ns=stamp_ns, pose=pose, covariance=_planar(covariance)))

    def difference(self, position: float, yaw: float, prediction: float) -> None:
        """Take how far the robots were apart [m], [rad], and how wrong the prediction had been [m]."""
        self._add("position", position)
        self._add("yaw", yaw)
        self._add("prediction", prediction)

    def gyroscope(self, stamp_ns: int, rate: float) -> None:
        """Take the physical robot's turn rate [rad/s]."""
        if math.isfinite(rate) and (not self._gyro or stamp_ns > self._gyro[-1][0]):
            self._gyro.append((stamp_ns, rate))

    def scan(self, scan: Scan, T_base_lidar: Pose2, now_ns: int) -> None:
        """Take what the physical lidar measured."""
        if self._flows["scans"].take(scan.stamp_ns, now_ns):
            self._scans.append((scan, T_base_lidar))

    def fits(self, fit: Fit) -> None:
        """Take how a scan of the physical lidar fits where localisation says that it was taken."""
        match = fit.match
        if match.returned < _LEAST_RETURNED and fit.on_map:
            return  # it tells nothing
        self._fit = fit
        contrary = min(match.shorter, match.longer) > _CONTRARY
        if fit.on_map and match.explained >= _LOST and (match.explained >= _UNSURE or not contrary):
            self._lost_ns = None
            return
        self._unsure_ns = match.stamp_ns
        if self._lost_ns is None:
            self._lost_ns = match.stamp_ns

    @property
    def doubts_localisation(self) -> bool:
        """Whether the latest scan, if one has told anything lately, shows too little of what it should."""
        fit, latest = self._fit, self._odom.latest
        if fit is None or (latest is not None and latest.stamp_ns - fit.match.stamp_ns > 2 * _SECOND_NS):
            return False
        return not fit.on_map or fit.match.explained < _UNSURE

    @property
    def lost(self) -> Lost | None:
        """For how long localisation has been wrong; None: it is not, as far as can be told."""
        if self._fit is None or self._lost_ns is None:
            return None
        return Lost(for_s=(self._fit.match.stamp_ns - self._lost_ns) * 1e-9, fit=self._fit)

    def virtual_scan(self, scan: Scan) -> None:
        """Take what the virtual one did."""
        self._virtual_scans.append(scan)

    def event(self, what: str, stamp_ns: int, *, physical: bool) -> None:
        """Take something that both robots should have happen to them at the same time."""
        found = self._pairs.take(what, stamp_ns, physical=physical)
        if found is not None:
            self._misalign(found)

    def pose_was_set(self, now_ns: int) -> None:
        """Somebody told localisation where the robot is."""
        self._told_pose_ns = now_ns

    def invalid(self, now_ns: int) -> None:
        """Something had numbers that are none."""
        self._invalid.append(now_ns)

    # What follows from it

    def step(self, now_ns: int) -> bool:
        """Judge what came up to now, if it is time to; return whether it was."""
        if self._stepped_ns is not None and 0 <= now_ns - self._stepped_ns < STEP_NS:
            return False
        self._stepped_ns = now_ns
        self._take_localised()
        self._take_turns()
        self._take_scans()
        for missing in self._pairs.overdue(now_ns):
            self._misalign(missing)
        self._response = self._responses.report() if now_ns // STEP_NS % 5 == 0 else self._response
        self.evidence = evidence = self._evidence(now_ns)
        if evidence.odometry is not None and evidence.odometry.delay_s is not None:
            self._add("delay", evidence.odometry.delay_s)
        if evidence.latency_s is not None:
            self._add("latency", evidence.latency_s)
        self.alarms.update(now_ns, causes(evidence))
        return True

    def report(self) -> Report:
        """Return all so far."""
        found = {name: series.summary() for name, series in self.series.items()}
        return Report(
            series={name: summary for name, summary in found.items() if summary is not None},
            alarms=self.alarms.all,
            alarm_count=self.alarms.count,
            misaligned=dict(self.misaligned),
        )

    def _add(self, name: str, value: float) -> None:
        if math.isfinite(value):
            self.series[name].add(value)
            self._told(name, value)

    def _misalign(self, found: Misalignment) -> None:
        if found.late_s is None:
            key = f"{found.what}: {found.only} only"
            self.misaligned[key] = self.misaligned.get(key, 0) + 1
        else:
            self._add("event", found.late_s)

    def _move(self, stamp_ns: int, speed: float, turn: float, *, physical: bool) -> None:
        changed = self._moving[physical].take(stamp_ns, abs(speed) + 0.3 * abs(turn))
        if changed is not None:
            self.event("goes" if changed[0] else "stops", changed[1], physical=physical)

    def _take_localised(self) -> None:
        while self._waiting:
            after = self._waiting[0]
            latest = self._odom.latest
            if latest is None or (latest.stamp_ns < after.stamp_ns):
                return
            self._waiting.popleft()
            before = self._believed
            early = before is not None and after.stamp_ns - before.stamp_ns < _TURN_NS
            if early and before is not None and self._odom.at(before.stamp_ns) is not None:
                continue  # a longer stretch tells more
            self._believed = after
            if before is None or after.stamp_ns <= before.stamp_ns:
                continue
            self._compare_motion(before, after)

    def _is_localised(self, stamp_ns: int) -> bool:
        """Whether scans, if there are any, have shown for a while what they should."""
        if not self._matches:
            return True
        latest = self._matches[-1]
        unsure = (stamp for stamp in (self._unsure_ns, self._jumped_ns) if stamp is not None)
        settled = all(stamp_ns - stamp > _SETTLING_NS for stamp in unsure)
        sees = latest.returned >= _LEAST_RETURNED * latest.expected  # in the open there is nothing to see
        return settled and sees and not self._frozen

    def _compare_motion(self, before: Believed, after: Believed) -> None:
        if not self._is_localised(after.stamp_ns):
            self._begin_stretch()
            return
        odom = [self._odom.at(one.stamp_ns) for one in (before, after)]
        if odom[0] is None or odom[1] is None:
            return
        came = before.pose.inverse() @ after.pose
        told = odom[0].pose.inverse() @ odom[1].pose
        apart = told.inverse() @ came
        if math.hypot(apart.x, apart.y) > _JUMP + math.hypot(told.x, told.y) or abs(
            apart.yaw
        ) > _JUMP_TURN + abs(told.yaw):
            self._found_jump, self._jumped_ns = (after.stamp_ns, apart), after.stamp_ns
            self._nis.clear()
            self._begin_stretch()
            return
        stated = [
            Believed(stamp_ns=one.stamp_ns, pose=one.pose, covariance=_planar(one.covariance))
            for one in odom
            if one is not None and one.covariance is not None
        ]
        if len(stated) == 2:
            self._nis.add(nis(before, after, *stated))
            mean = self._nis.mean
            assert mean is not None
            self._add("nis", mean)
        virtual = [
            history.at(one.stamp_ns)
            for history in (self._virtual_odom, self._driven)
            for one in (before, after)
        ]
        places = [place.pose for place in virtual if place is not None]
        if len(places) < 4:
            return
        model = places[0].inverse() @ places[1], places[2].inverse() @ places[3]
        motions = (told, came, *model)
        self._stretch += [(motion.x, motion.yaw) for motion in motions]
        self._way += np.abs([told.x, told.yaw])
        if np.any(self._way >= _STRETCH):
            (told_x, told_yaw), (came_x, came_yaw), (model_x, model_yaw), (driven_x, driven_yaw) = (
                self._stretch
            )
            self._distances.add(after.stamp_ns, told_x, came_x)
            self._localised_turns.add(after.stamp_ns, told_yaw, came_yaw)
            self._nominal_distances.add(after.stamp_ns, model_x, driven_x)
            self._nominal_turns.add(after.stamp_ns, model_yaw, driven_yaw)
            self._begin_stretch()

    def _begin_stretch(self) -> None:
        """Errors of localisation at both ends of a stretch count less the longer it is."""
        self._stretch, self._way = np.zeros((4, 2)), np.zeros(2)

    def _take_turns(self) -> None:
        if not self._gyro or self._odom.latest is None:
            return
        if self._gyro_from_ns is None:
            self._gyro_from_ns = max(self._gyro[0][0], self._odom.latest.stamp_ns)
        last = min(self._gyro[-1][0], self._odom.latest.stamp_ns)
        while last - self._gyro_from_ns >= _TURN_NS:
            first, end = self._gyro_from_ns, self._gyro_from_ns + _TURN_NS
            self._gyro_from_ns = end
            self._compare_turn(first, end)

    def _compare_turn(self, first: int, end: int) -> None:
        rows = [row for row in self._gyro if first - 60_000_000 <= row[0] <= end + 60_000_000]
        if len(rows) < 4 or rows[0][0] > first or rows[-1][0] < end:
            return
        told = self._told_turn(first, end)
        if told is None:
            return
        stamps = np.array([row[0] - first for row in rows]) * 1e-9
        rates = np.array([row[1] for row in rows])
        length = (end - first) * 1e-9
        angles = np.concatenate([[0.0], np.cumsum((rates[1:] + rates[:-1]) / 2.0 * np.diff(stamps))])
        came = float(np.interp(length, stamps, angles) - np.interp(0.0, stamps, angles))
        turn, way = told
        came -= self._gyro_bias * length
        if abs(turn) < _STILL * length and way < _STILL * length:
            self._standing.append((end, came))
            if abs(came) < 0.1:
                self._gyro_bias += 0.1 * came / length
        elif abs(turn) + way > 0.01:
            self._turns.add(end, turn, came)

    def _told_turn(self, first: int, end: int) -> tuple[float, float] | None:
        """Return turn and way of the wheels between two times; turns may be more than half a turn."""
        middle = (first + end) // 2
        places = [self._odom.at(stamp) for stamp in (first, middle, end)]
        if any(place is None for place in places):
            return None
        a, b, c = (place.pose for place in places if place is not None)
        return wrap_angle(b.yaw - a.yaw) + wrap_angle(c.yaw - b.yaw), a.distance(b) + b.distance(c)

    def _take_scans(self) -> None:
        while self._scans and self._virtual_scans:
            scan, T_base_lidar = self._scans[0]
            latest, newest_ns = self._virtual.latest, self._virtual_scans[-1].stamp_ns
            waits = latest is None or min(latest.stamp_ns, newest_ns) < scan.stamp_ns
            if waits and newest_ns > scan.stamp_ns - _WAITS_NS:
                return  # a later one may be nearer
            self._scans.popleft()
            expected = min(self._virtual_scans, key=lambda one: abs(one.stamp_ns - scan.stamp_ns))
            places = self._virtual.at(expected.stamp_ns), self._virtual.at(scan.stamp_ns)
            if places[0] is None or places[1] is None or abs(expected.stamp_ns - scan.stamp_ns) > _PAIRED_NS:
                continue
            there, here = (place.pose @ T_base_lidar for place in places if place is not None)
            self._match(compare(expected, scan, there.inverse() @ here), scan, here)

    def _match(self, match: ScanMatch, scan: Scan, lidar: Pose2) -> None:
        odom = self._odom.latest
        returned = match.returned >= _LEAST_RETURNED
        self._frozen = returned and odom is not None and self._repeated.is_frozen(scan.ranges, odom.pose)
        before, corrected = self._matches[-1] if self._matches else None, self._corrected(match.stamp_ns)
        self._matches.append(match)
        self._add("scan", 1.0 - match.explained)
        if not returned or self._frozen:
            self._places = Places()
            return
        self._add("scan_residual", match.residual)
        contrary = min(match.shorter, match.longer) > _CONTRARY
        if (match.explained < _UNSURE and contrary) or match.residual > _UNSURE_RESIDUAL:
            self._unsure_ns = match.stamp_ns
            self._places = Places()
        self._places.take(match.stamp_ns, lidar, match.things)
        if match.explained >= 0.8:
            self._broke_ns = None
        elif (
            before is not None
            and before.returned >= _LEAST_RETURNED
            and match.stamp_ns - before.stamp_ns < _SECOND_NS // 2
            and match.explained < before.explained - _BREAK
            and not corrected
            and not self._turns.odd(match.stamp_ns - _RECENT_NS, _TWISTED)
        ):
            self._broke_ns = match.stamp_ns

    def _corrected(self, stamp_ns: int) -> bool:
        """Return whether the virtual robot was moved, rather than drove, since it was asked last."""
        virtual, driven = self._virtual.at(stamp_ns), self._driven.at(stamp_ns)
        if virtual is None or driven is None:
            return True
        correction, before = virtual.pose @ driven.pose.inverse(), self._correction
        self._correction = correction
        if before is None:
            return True
        moved = virtual.pose.distance(before @ driven.pose)
        return moved > _JUMP or abs(wrap_angle(correction.yaw - before.yaw)) > _JUMP

    def _evidence(self, now_ns: int) -> Evidence:
        since = now_ns - _RECENT_NS
        flows = {name: flow.report(now_ns) for name, flow in self._flows.items()}
        recent = [jump for jump in self._jumps if now_ns - jump[0] < 3 * _SECOND_NS]
        if not recent and self._restarted is not None:
            if self._is_unsure(now_ns):
                recent = [self._restarted]  # it has not been found yet
            else:
                self._restarted = None
        count = sum(1 for stamp in self._odom_count if now_ns - stamp < 3 * _SECOND_NS)
        jumped = None
        if recent:
            stamp, step, to_start = recent[-1]
            jumped = Jump(
                age_s=(now_ns - stamp) * 1e-9,
                distance=math.hypot(step.x, step.y),
                turn=step.yaw,
                to_start=to_start,
            )
        found = None
        if self._found_jump is not None and self._found_jump[0] >= since:
            stamp, step = self._found_jump
            found = Jump(age_s=(now_ns - stamp) * 1e-9, distance=math.hypot(step.x, step.y), turn=step.yaw)
        bounds = self._nis.bounds
        turns = self._turns if self._turns.moved else self._localised_turns
        return Evidence(
            odometry=flows["odometry"],
            scans=flows["scans"],
            clock_bound_s=self.clock_bound_s,
            invalid=sum(1 for stamp in self._invalid if now_ns - stamp < 3 * _SECOND_NS),
            publishers=self.publishers,
            alternating=len(recent) / count if len(recent) > 2 else 0.0,
            odometry_jump=jumped,
            localisation_jump=found,
            lost=self.lost,
            pose_was_set=self._told_pose_ns is not None and self._told_pose_ns >= since,
            scan=self._scan_evidence(now_ns),
            more=self._places.found("more"),
            less=self._places.found("less"),
            distances=_over(self._distances.ratio(0.004), self._nominal_distances.ratio(0.002)),
            turns=_over(turns.ratio(0.002), self._nominal_turns.ratio(0.002)),
            slipped=tuple(self._distances.odd(since, _SLIPPED)),
            twisted=tuple(self._turns.odd(since, _TWISTED)),
            turned_standing=abs(sum(turn for stamp, turn in self._standing if stamp >= since)),
            response=self._response.ratio,
            latency_s=self._response.latency_s,
            position=self.series["position"].latest,
            yaw=self.series["yaw"].latest,
            nis=self._nis.mean,
            nis_bound=None if bounds is None else bounds[1],
        )

    def _is_unsure(self, now_ns: int) -> bool:
        return self._unsure_ns is not None and 0 <= now_ns - self._unsure_ns < _SECOND_NS

    def _scan_evidence(self, now_ns: int) -> ScanEvidence | None:
        latest = [one for one in self._matches if 0 <= now_ns - one.stamp_ns < 2 * _SECOND_NS][-10:]
        if not latest:
            return None
        table = np.array(
            [(m.explained, m.shorter, m.longer, m.returned, m.expected, m.offset) for m in latest]
        )
        explained, shorter, longer, returned, expected, offset = np.median(table, axis=0).tolist()
        return ScanEvidence(
            explained=explained,
            shorter=shorter,
            longer=longer,
            returned=returned,
            expected=expected,
            residual=latest[-1].residual,
            offset=offset,
            localised_s=math.inf if self._unsure_ns is None else (now_ns - self._unsure_ns) * 1e-9,
            frozen=self._frozen,
            unreadable=returned == 0.0 and shorter == longer == 0.0 and expected > 0.0,
            broke_s=None if self._broke_ns is None else max(0.0, (now_ns - self._broke_ns) * 1e-9),
        )


def _planar(covariance: Array | None) -> Array:
    assert covariance is not None
    rows = np.asarray(covariance).reshape(6, 6)
    return np.asarray(rows[np.ix_((0, 1, 5), (0, 1, 5))])


def _over(ratio: Ratio | None, nominal: Ratio | None) -> Ratio | None:
    """Return a ratio as a share of the virtual robot's, which has its model's own errors."""
    if ratio is None or nominal is None or nominal.stddev > 0.01 or abs(nominal.value - 1.0) > 0.2:
        return ratio
    return Ratio(
        value=ratio.value / nominal.value,
        stddev=math.hypot(ratio.stddev, nominal.stddev),
        drift=ratio.drift,
        drift_stddev=ratio.drift_stddev,
    )
