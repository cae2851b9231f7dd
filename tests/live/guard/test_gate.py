"""What a guard lets through."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from twin.controllers.limiter import AxisLimits
from twin.live.guard.gate import STILL, Gate, GateConfig, Lane, Velocity
from twin.nodes.guard.verdict import Verdict

MS = 1_000_000
OTHER_CLOCK_NS = 1_700_000_000_000_000_000
"""A sender's clock minus ours."""
NAN, INF = math.nan, math.inf


def released(**config: object) -> Gate:
    gate = Gate(GateConfig(**config))  # type: ignore[arg-type]
    assert gate.release(None, 0)
    return gate


def send(
    gate: Gate,
    at_ms: float,
    x: float = 0.3,
    yaw: float = 0.0,
    *,
    y: float = 0.0,
    late_ms: float = 5.0,
    lane: Lane = Lane.AUTONOMY,
    sender: str = "a",
) -> Verdict:
    """Have a command arrive that was under way for so long."""
    stamp_ns = OTHER_CLOCK_NS + round((at_ms - late_ms) * MS)
    return gate.command(lane, sender, stamp_ns, (x, y, 0.0, 0.0, 0.0, yaw), round(at_ms * MS))


def output(gate: Gate, at_ms: float) -> Velocity:
    return gate.output(round(at_ms * MS))


def test_an_accepted_command_holds_until_the_time_out() -> None:
    gate = released()
    assert send(gate, 100) is Verdict.ACCEPTED
    assert output(gate, 100) == output(gate, 599) == Velocity(0.3)
    assert output(gate, 601) == STILL
    assert gate.in_charge(601 * MS) is None


def test_it_begins_stopped() -> None:
    gate = Gate(GateConfig())
    assert gate.stopped_by == "start"
    assert send(gate, 100) is Verdict.STOPPED
    assert output(gate, 100) == STILL


@pytest.mark.parametrize(
    ("stamp_ns", "verdict"),
    [
        (1_000, Verdict.DUPLICATE),
        (999, Verdict.OUT_OF_ORDER),
        (1_001, Verdict.ACCEPTED),
        (0, Verdict.NOT_STAMPED),
        (-5, Verdict.NOT_STAMPED),
    ],
)
def test_a_stamp_is_a_commands_identity(stamp_ns: int, verdict: Verdict) -> None:
    gate = released()
    forward, back = (0.3, 0.0, 0.0, 0.0, 0.0, 0.0), (-0.3, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert gate.command(Lane.AUTONOMY, "a", 1_000, forward, MS) is Verdict.ACCEPTED
    assert gate.command(Lane.AUTONOMY, "a", stamp_ns, back, 2 * MS) is verdict
    assert (output(gate, 2).x < 0.0) == (verdict is Verdict.ACCEPTED)
    assert gate.verdicts[verdict] == 1 + (verdict is Verdict.ACCEPTED)


def test_a_command_is_not_done_again_after_a_silence_or_a_stop() -> None:
    gate = released()
    assert send(gate, 100) is Verdict.ACCEPTED
    assert send(gate, 60_100, late_ms=60_005) is Verdict.DUPLICATE
    gate.stop("", 60_200 * MS)
    assert send(gate, 60_300) is Verdict.STOPPED
    gate.release(None, 60_400 * MS)
    assert output(gate, 60_400) == STILL, "what it was told before the stop is forgotten"
    assert send(gate, 60_500, late_ms=205) is Verdict.DUPLICATE, "of one that was refused, too"
    assert send(gate, 60_600) is Verdict.ACCEPTED


@pytest.mark.parametrize("other_clock_ns", [0, 3_600_000_000_000, OTHER_CLOCK_NS])
def test_age_needs_no_common_clock(other_clock_ns: int) -> None:
    gate = released(max_age=0.25)

    def arrive(at_ms: float, late_ms: float) -> Verdict:
        stamp_ns = other_clock_ns + round((at_ms - late_ms) * MS)
        return gate.command(Lane.AUTONOMY, "a", stamp_ns, (0.3, 0, 0, 0, 0, 0), round(at_ms * MS))

    for at_ms in range(1000, 2000, 50):
        assert arrive(at_ms, 80 + at_ms % 3) is Verdict.ACCEPTED
    # The cable is cut for 3 s, and all that was sent comes at once.
    burst = [arrive(5000 + n, 3000 - 50 * n) for n in range(59)]
    assert burst[:50] == [Verdict.OLD] * 50
    assert burst[-1] is Verdict.ACCEPTED
    assert arrive(5100, 80) is Verdict.ACCEPTED


@pytest.mark.parametrize("drift", [-200e-6, 200e-6])
def test_a_clock_that_drifts_makes_nothing_old(drift: float) -> None:
    gate = released()
    for second in [*range(1, 200), 2000, 5000, 5001]:
        now_ns = second * 1000 * MS
        stamp_ns = OTHER_CLOCK_NS + round(now_ns * (1.0 + drift))
        verdict = gate.command(Lane.AUTONOMY, "a", stamp_ns, (0.1, 0, 0, 0, 0, 0), now_ns)
        assert verdict is Verdict.ACCEPTED


@pytest.mark.parametrize("wrong", [NAN, INF, -INF])
@pytest.mark.parametrize("axis", range(6))
def test_what_is_not_finite_is_refused_and_the_robot_stops(axis: int, wrong: float) -> None:
    gate = released()
    send(gate, 100)
    for at_ms in range(150, 1000, 50):
        twist = [0.0] * 6
        twist[axis] = wrong
        stamp_ns = OTHER_CLOCK_NS + at_ms * MS
        assert gate.command(Lane.AUTONOMY, "a", stamp_ns, twist, at_ms * MS) is Verdict.NOT_FINITE
    assert output(gate, 1000) == STILL
    assert send(gate, 1050) is Verdict.ACCEPTED


def test_speed_keeps_its_direction_and_turns_have_their_own_limit() -> None:
    gate = released(linear=AxisLimits(max_velocity=0.5), angular=AxisLimits(max_velocity=1.0))
    send(gate, 100, x=3.0, y=-4.0, yaw=-9.0)
    assert output(gate, 100) == pytest.approx((0.3, -0.4, -1.0))


def test_it_speeds_up_and_brakes_within_its_limits_but_a_stop_is_at_once() -> None:
    gate = released(linear=AxisLimits(max_acceleration=1.0, max_deceleration=2.0))
    output(gate, 80)
    send(gate, 80, x=1.0)
    assert [round(output(gate, at_ms).x, 9) for at_ms in (100, 120)] == [0.02, 0.04]
    for at_ms in range(140, 1200, 20):
        send(gate, at_ms, x=1.0)
        output(gate, at_ms)
    send(gate, 1200, x=0.0)
    assert round(output(gate, 1200).x, 9) == 0.96
    gate.stop("me", 1201 * MS)
    assert output(gate, 1201) == STILL


def test_a_guard_that_was_held_up_does_not_leap() -> None:
    gate = released(linear=AxisLimits(max_acceleration=1.0))
    output(gate, 100)
    send(gate, 9000, x=1.0)
    assert output(gate, 9000).x <= 0.1


def test_the_operator_goes_before_autonomy_and_keeps_it_off_for_a_while() -> None:
    gate = released(operator_hold=1.0)
    send(gate, 100, x=0.3)
    assert send(gate, 150, x=0.1, lane=Lane.OPERATOR, sender="joystick") is Verdict.ACCEPTED
    assert output(gate, 150).x == 0.1
    assert send(gate, 200, x=0.3) is Verdict.OVERRIDDEN
    assert output(gate, 200).x == 0.1
    assert send(gate, 1100, x=0.3) is Verdict.OVERRIDDEN
    assert output(gate, 1100) == STILL, "the operator is silent, autonomy has to wait"
    assert send(gate, 1200, x=0.3) is Verdict.ACCEPTED
    assert output(gate, 1200).x == 0.3


def test_two_senders_at_a_time_are_not_mixed() -> None:
    gate = released()
    send(gate, 100, x=0.3, sender="a")
    assert send(gate, 120, x=-0.3, sender="b") is Verdict.RIVAL
    assert output(gate, 120).x == 0.3
    assert send(gate, 700, x=-0.3, sender="b") is Verdict.ACCEPTED, "the first one is silent"
    assert send(gate, 720, x=0.3, sender="a") is Verdict.RIVAL


def test_a_stop_holds_until_a_release_by_somebody_who_has_seen_it() -> None:
    gate = released()
    gate.told(1, 100 * MS)
    gate.stop("me", 200 * MS)
    assert (gate.stopped_by, gate.stops) == ("me", 1)
    gate.told(2, 210 * MS)
    assert not gate.release(1, 220 * MS), "it knows nothing of this stop"
    assert not gate.release(3, 220 * MS), "nobody has told that"
    assert not gate.release(2, 2_211 * MS), "it was under way for too long"
    gate.told(4, 2_300 * MS)
    gate.stop("another", 2_400 * MS)
    assert not gate.release(4, 2_500 * MS), "it was stopped again meanwhile"
    assert gate.stops == 1
    gate.told(5, 2_600 * MS)
    assert gate.release(5, 2_700 * MS)
    assert gate.release(5, 2_750 * MS), "its acknowledgement was lost"
    gate.stop("me", 2_800 * MS)
    assert not gate.release(5, 2_850 * MS)
    assert gate.stopped_by == "me"


@given(
    st.lists(st.tuples(st.integers(1, 60), st.integers(0, 4000), st.sampled_from(["a", "b"])), max_size=60)
)
def test_whatever_the_link_does_no_command_is_done_twice_or_late(
    arrivals: list[tuple[int, int, str]],
) -> None:
    """Command n is sent at 50 n ms; commands are lost, doubled, late and reordered in any way."""
    gate = released(max_age=0.25, operator_hold=0.0)
    done: dict[str, list[int]] = {"a": [], "b": []}
    quickest: dict[str, float] = {}
    for n, late_ms, sender in sorted(arrivals, key=lambda each: 50 * each[0] + each[1]):
        verdict = send(gate, 50 * n + late_ms, late_ms=late_ms, x=n / 100, sender=sender)
        if verdict is Verdict.ACCEPTED:
            done[sender].append(n)
            quickest[sender] = min(quickest.get(sender, math.inf), late_ms)
            assert late_ms <= quickest[sender] + 250 + 4
            assert output(gate, 50 * n + late_ms).x == pytest.approx(n / 100)
    for numbers in done.values():
        assert numbers == sorted(set(numbers))
