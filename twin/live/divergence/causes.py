"""What makes the physical robot differ from its model: one rule for each cause.

A rule names its cause only if the evidence tells it from the others; what differs for none is `unknown`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from twin.live.divergence.alarms import Finding, Threshold
from twin.live.divergence.evidence import Evidence
from twin.live.divergence.motion import Ratio

THRESHOLDS = {
    "silent robot": Threshold(on=1.0, off=0.5, for_s=0.0, until_s=0.4),  # [s]
    "late link": Threshold(on=0.2, off=0.15),  # [s]
    "lossy link": Threshold(on=0.15, off=0.08, for_s=2.0),  # share of messages
    "invalid data": Threshold(on=1.0, off=1.0, for_s=0.0),  # messages
    "duplicate robot": Threshold(on=0.15, off=0.05, for_s=1.0),  # share of messages, or 1 for each robot more
    "robot restarted": Threshold(on=0.0, off=0.0, for_s=0.0),  # [m]
    "odometry jump": Threshold(on=0.3, off=0.3, for_s=0.6),  # [m] or [rad]
    "blind lidar": Threshold(on=0.4, off=0.2, for_s=1.0),  # share of rays
    "lidar bias": Threshold(on=0.05, off=0.03, for_s=4.0),  # [m]
    "obstacle not in the model": Threshold(on=15.0, off=1.0, for_s=0.4),  # scans
    "obstacle of the model is gone": Threshold(on=15.0, off=1.0, for_s=0.4),  # scans
    "localisation lost": Threshold(on=4.0, off=0.1, for_s=0.0),  # [s]
    "kidnapped": Threshold(on=0.4, off=0.15, for_s=0.3),  # share of rays
    "wheel slip": Threshold(on=0.06, off=0.03, for_s=0.4, until_s=5.0),  # [m] or [rad]
    "wheel radius": Threshold(on=0.01, off=0.006, for_s=2.0, until_s=5.0),  # share
    "track": Threshold(on=0.01, off=0.006, for_s=2.0, until_s=5.0),  # share
    "commands not followed": Threshold(on=0.3, off=0.15, for_s=1.0),  # share
    "late response": Threshold(on=0.25, off=0.15, for_s=2.0),  # [s]
    "unknown": Threshold(on=1.0, off=0.7, for_s=8.0),  # in units of what is allowed
}
"""When each alarm begins and ends; in which unit its number is."""

_SURE = 5.0
"""Standard deviations that a share must be off."""
_LOCALISED_S = 4.0
"""For so long a robot has to be where it is thought to be, before what it sees is a thing there [s]."""
_POSITION, _YAW, _EXPLAINED = 0.15, 0.15, 0.75
"""What two robots may differ by without a reason [m], [rad], and how much of a scan has to be explained."""
_BESIDE = 0.05
"""A lidar is judged by one that is no farther from it [m], [rad]."""
_LARGEST_BIAS = 1.0
"""What differs by more is seen from another place [m]."""
_NIS = 3.0
"""The mean NIS may be so many times larger than by chance: localisation's covariance is an estimate, too."""


def causes(evidence: Evidence) -> list[Finding]:
    """Return what is found now, however small; see `THRESHOLDS`."""
    odometry = evidence.odometry
    if odometry is None:
        return []
    if odometry.age_s >= THRESHOLDS["silent robot"].off:
        text = f"nothing came for {odometry.age_s:.1f} s: it has no power, or its link is cut"
        return [Finding(cause="silent robot", number=odometry.age_s, text=text)]
    doubles = list(_duplicate(evidence))
    if any(found.number >= THRESHOLDS[found.cause].off for found in doubles):
        return doubles  # what one number says for two robots is about neither
    found = [finding for rule in (*_ANY_TIME, *_rules(evidence)) for finding in rule(evidence)]
    matters = [each for each in found if each.number >= THRESHOLDS[each.cause].on]
    return found if matters else [*found, *_unknown(evidence)]


def _rules(evidence: Evidence) -> tuple[Callable[[Evidence], Iterator[Finding]], ...]:
    """Return which rules can be believed."""
    if evidence.odometry_jump is not None or evidence.invalid:
        return (_blind,)
    if evidence.lost is not None:
        return (_blind, _kidnapped)
    return (_blind, _bias, _things, _kidnapped, _slip, _wheels, _response)


def _link(evidence: Evidence) -> Iterator[Finding]:
    flow = evidence.odometry
    assert flow is not None
    if flow.late_s is not None and flow.delay_s is not None:
        late = flow.delay_s - evidence.clock_bound_s
        yield Finding(
            cause="late link",
            number=late,
            text=f"messages take {flow.delay_s * 1e3:.0f} ms, a tenth more than {flow.late_s * 1e3:.0f} ms",
        )
    if flow.lost is not None:
        yield Finding(cause="lossy link", number=flow.lost, text=f"{flow.lost:.0%} of the messages are lost")


def _invalid(evidence: Evidence) -> Iterator[Finding]:
    if evidence.invalid:
        text = f"{evidence.invalid} messages with numbers that are none in 3 s"
        yield Finding(cause="invalid data", number=float(evidence.invalid), text=text)


def _duplicate(evidence: Evidence) -> Iterator[Finding]:
    if evidence.publishers is not None and evidence.publishers > 1:
        text = f"{evidence.publishers} robots publish the same odometry"
        yield Finding(cause="duplicate robot", number=float(evidence.publishers - 1), text=text)
    elif evidence.alternating:
        text = f"{evidence.alternating:.0%} of the odometry is of another robot with the same name"
        yield Finding(cause="duplicate robot", number=evidence.alternating, text=text)


def _odometry_jump(evidence: Evidence) -> Iterator[Finding]:
    jump = evidence.odometry_jump
    if jump is None:
        return
    if jump.to_start:
        text = f"odometry begins again, {jump.distance:.2f} m from where it was"
        yield Finding(cause="robot restarted", number=jump.distance, text=text)
    else:
        text = f"odometry jumped by {jump.distance:.2f} m and {math.degrees(jump.turn):.0f} deg"
        yield Finding(cause="odometry jump", number=max(jump.distance, abs(jump.turn)), text=text)


def _lost(evidence: Evidence) -> Iterator[Finding]:
    if evidence.lost is None:
        return
    fit = evidence.lost.fit
    place = f"({fit.pose.x:.2f}, {fit.pose.y:.2f})"
    wrong = 1.0 - fit.match.explained
    text = f"it finds the robot at {place}, where {wrong:.0%} of the rays should end elsewhere"
    if not fit.on_map:
        text = f"it finds the robot at {place}, which is not on the map"
    yield Finding(cause="localisation lost", number=evidence.lost.for_s, text=text)


_ANY_TIME: tuple[Callable[[Evidence], Iterator[Finding]], ...] = (_link, _invalid, _odometry_jump, _lost)


def _blind(evidence: Evidence) -> Iterator[Finding]:
    flow, scan = evidence.scans, evidence.scan
    if flow is not None and flow.age_s > 1.0:
        yield _lidar(1.0, f"no scan for {flow.age_s:.1f} s, but odometry comes")
    elif scan is None:
        return
    elif scan.unreadable:
        yield _lidar(1.0, "no ray has a reading")
    elif scan.frozen:
        yield _lidar(1.0, "the same scan comes again and again while the robot moves")
    elif scan.returned < 0.1 and scan.expected > 0.0:
        yield _lidar(
            scan.expected - scan.returned,
            f"{scan.returned:.0%} of the rays return, {scan.expected:.0%} should",
        )
    elif evidence.more is not None and evidence.more.is_carried and scan.shorter > 0.05:
        yield _lidar(
            max(0.4, scan.shorter),
            f"{scan.shorter:.0%} of the rays end on something that moves with the robot",
        )
    elif evidence.less is not None and evidence.less.is_carried and scan.longer > 0.05:
        yield _lidar(max(0.4, scan.longer), f"{scan.longer:.0%} of the rays, always the same, see too far")


def _bias(evidence: Evidence) -> Iterator[Finding]:
    scan = evidence.scan
    if scan is None or scan.broke_s is not None or not _sees(evidence):
        return
    is_beside = max(evidence.position or 0.0, abs(evidence.yaw or 0.0)) < _BESIDE
    if is_beside and abs(scan.offset) < _LARGEST_BIAS:
        text = f"rays measure {scan.offset:+.2f} m more than they should, all around"
        yield Finding(cause="lidar bias", number=abs(scan.offset), text=text)


def _lidar(share: float, text: str) -> Finding:
    return Finding(cause="blind lidar", number=share, text=text)


def _sees(evidence: Evidence) -> bool:
    """Whether scans tell of the world."""
    return evidence.scan is not None and not any(
        found.number >= THRESHOLDS["blind lidar"].off for found in _blind(evidence)
    )


def _things(evidence: Evidence) -> Iterator[Finding]:
    scan = evidence.scan
    if scan is None or not _sees(evidence) or scan.localised_s < _LOCALISED_S or scan.broke_s is not None:
        return
    for place, cause, text in (
        (
            evidence.more,
            "obstacle not in the model",
            "something {:.1f} m wide stands at ({:.2f}, {:.2f}) where nothing is expected",
        ),
        (
            evidence.less,
            "obstacle of the model is gone",
            "something {:.1f} m wide at ({:.2f}, {:.2f}) is not there",
        ),
    ):
        if place is not None and not place.is_carried:
            yield Finding(
                cause=cause,
                number=float(place.sightings),
                text=text.format(place.width, place.x, place.y),
            )


def _kidnapped(evidence: Evidence) -> Iterator[Finding]:
    scan = evidence.scan
    if scan is None or scan.broke_s is None or not _sees(evidence):
        return
    if evidence.pose_was_set:
        return
    if min(scan.shorter, scan.longer) < 0.05:
        return
    text = f"{1.0 - scan.explained:.0%} of the rays end elsewhere from one scan to the next: it was moved"
    yield Finding(cause="kidnapped", number=1.0 - scan.explained, text=text)


def _slip(evidence: Evidence) -> Iterator[Finding]:
    if evidence.turned_standing > 0.2:
        return  # somebody turns it
    turned = sum(abs(stretch.residual) for stretch in evidence.twisted)
    drove = sum(abs(stretch.residual) for stretch in evidence.slipped)
    if turned > drove:
        times = len(evidence.twisted)
        text = (
            f"it turned by {math.degrees(turned):.0f} deg in {times / 2:g} s that its wheels do not tell of"
        )
        yield Finding(cause="wheel slip", number=turned, text=text)
    elif drove:
        text = f"its wheels tell of {drove:.2f} m that it did not drive"
        yield Finding(cause="wheel slip", number=drove, text=text)


def _wheels(evidence: Evidence) -> Iterator[Finding]:
    if evidence.slipped or evidence.twisted or not _sees(evidence):
        return
    distances, turns = evidence.distances, evidence.turns
    radius = None
    if distances is not None and _is_one(distances):
        radius = distances.value
        if _is_off(distances):
            text = f"wheels roll {_share(distances)} of what odometry believes"
            yield Finding(cause="wheel radius", number=abs(radius - 1.0), text=text)
    if turns is None or radius is None or not _is_one(turns) or turns.value <= 0.5:
        return
    assert distances is not None
    track = Ratio(
        value=radius / turns.value,
        stddev=math.hypot(turns.stddev, distances.stddev),
        drift=turns.drift,
        drift_stddev=turns.drift_stddev,
    )
    if _is_off(track):
        text = f"wheels are {_share(track)} as far apart as odometry believes"
        yield Finding(cause="track", number=abs(track.value - 1.0), text=text)


def _is_one(ratio: Ratio) -> bool:
    """Whether a ratio is a property of the robot: it does not change."""
    return ratio.stddev < 0.01 and abs(ratio.drift) <= max(0.01, 4.0 * ratio.drift_stddev)


def _is_off(ratio: Ratio) -> bool:
    return abs(ratio.value - 1.0) >= _SURE * ratio.stddev


def _share(ratio: Ratio) -> str:
    return f"{ratio.value * 100.0:.1f} % (+- {200.0 * ratio.stddev:.1f} %)"


def _response(evidence: Evidence) -> Iterator[Finding]:
    if evidence.response is not None:
        text = f"wheels go {evidence.response:.0%} of what the commands ask for"
        yield Finding(cause="commands not followed", number=abs(1.0 - evidence.response), text=text)
    flow, latency = evidence.odometry, evidence.latency_s
    assert flow is not None
    if latency is not None and (flow.delay_s or 0.0) < 0.7 * latency:  # the link's delay is not the robot's
        yield Finding(
            cause="late response",
            number=latency,
            text=f"the wheels obey {latency * 1e3:.0f} ms later than the model's",
        )


def _unknown(evidence: Evidence) -> Iterator[Finding]:
    scan, nis, bound, turns = evidence.scan, evidence.nis, evidence.nis_bound, evidence.turns
    innovation = "the normalised innovation squared is {:.1f}, not 3"
    if evidence.distances is None and turns is not None and _is_one(turns) and _is_off(turns):
        innovation += f"; turns come to {_share(turns)} of what odometry believes: by wheel radius or track"
    rows = [
        (evidence.position, _POSITION, "the robots are {:.2f} m apart"),
        (None if evidence.yaw is None else abs(evidence.yaw), _YAW, "one is turned by {:.2f} rad"),
        (
            None if scan is None else 1.0 - scan.explained,
            1.0 - _EXPLAINED,
            "{:.0%} of the rays end where nothing was expected",
        ),
        (nis, _NIS * (bound or 1.0), innovation),
    ]
    known = [(number / allowed, text.format(number)) for number, allowed, text in rows if number is not None]
    if known:
        number, text = max(known)
        yield Finding(cause="unknown", number=number, text=text)
