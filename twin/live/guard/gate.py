"""What a guard lets through to its robot, as a state machine without topics and clocks.

Every `now_ns` is by a clock that is never set, such as the time since the computer was started [ns].
"""

from __future__ import annotations

import math
from collections import Counter, OrderedDict
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

from twin.controllers.emergency_stop import RELEASE_WITHIN_S, EmergencyStop
from twin.controllers.limiter import AxisLimits, SpeedLimiter
from twin.controllers.twist_mux import MuxInput, TwistMux
from twin.live.guard.stamps import SenderStamps
from twin.nodes.guard.verdict import Verdict

_MOST_SENDERS = 1000
_LONGEST_STEP_S = 0.1
"""A process that was held up does not speed its robot up in one go."""


class Lane(StrEnum):
    """Who commands."""

    AUTONOMY = "autonomy"
    OPERATOR = "operator"


@dataclass(frozen=True, kw_only=True)
class GateConfig:
    """What a robot is spared."""

    linear: AxisLimits = field(default_factory=AxisLimits)
    """Of its speed over ground."""
    angular: AxisLimits = field(default_factory=AxisLimits)
    """Of its turns about z."""
    command_timeout: float = 0.5
    """Without an accepted command for this long it is brought to a stop [s]."""
    operator_hold: float = 1.0
    """So long [s] after an operator's last command autonomy's are refused."""
    max_age: float = 0.25
    """A command may be under way for so much longer [s] than the quickest of its sender."""
    release_within: float = RELEASE_WITHIN_S
    """A release may come so long [s] after the status that its sender saw."""

    @property
    def words(self) -> str:
        """What it allows, for people."""
        rows = ((self.linear, "m"), (self.angular, "rad"))
        pairs = [(limits.max_velocity, f"{unit}/s") for limits, unit in rows]
        pairs += [(limits.max_acceleration, f"{unit}/s²") for limits, unit in rows]
        told = [f"{most:g} {unit}" for most, unit in pairs if math.isfinite(most)]
        return f"at most {', '.join(told)}" if told else "no limits"


class Velocity(NamedTuple):
    """Of the base, in its own frame."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0


STILL = Velocity()


class Gate(EmergencyStop):
    """Stopped from the start: who begins anew does not know whether it was stopped before."""

    def __init__(self, config: GateConfig) -> None:
        """Wait for a release."""
        super().__init__("start", config.release_within)
        self.config = config
        self.verdicts: Counter[Verdict] = Counter()
        """How many commands, by what became of them."""
        self._senders: OrderedDict[tuple[Lane, Hashable], SenderStamps] = OrderedDict()
        self._limited_ns: int | None = None
        self._halt()

    def command(
        self, lane: Lane, sender: Hashable, stamp_ns: int, twist: Sequence[float], now_ns: int
    ) -> Verdict:
        """Judge a command, and go by it if it is accepted.

        Args:
            lane: By whom.
            sender: Whatever tells senders from each other; one that starts again is another one.
            stamp_ns: By the sender's clock [ns].
            twist: Linear x, y, z [m/s], angular x, y, z [rad/s].
            now_ns: When it arrived.
        """
        verdict = self._stamps(lane, sender).judge(stamp_ns, now_ns)
        if verdict is Verdict.ACCEPTED:
            verdict = self._judge(lane, sender, twist, now_ns)
        if verdict is Verdict.ACCEPTED:
            self._mux.accept(lane, now_ns * 1e-9)
            self._accepted[lane] = (sender, Velocity(twist[0], twist[1], twist[5]), now_ns)
        self.verdicts[verdict] += 1
        return verdict

    def stop(self, by: str, now_ns: int) -> None:
        """Stop the robot at once, until a release."""
        super().stop(by, now_ns)
        self._halt()

    def in_charge(self, now_ns: int) -> Lane | None:
        """Return whose commands count now; None: nobody's, as nobody has commanded lately."""
        name = self._mux.active(now_ns * 1e-9)
        return None if name is None else Lane(name)

    def output(self, now_ns: int) -> Velocity:
        """Return what the robot is told now."""
        wanted = STILL
        lane = self.in_charge(now_ns)
        if lane is not None:
            _, velocity, accepted_ns = self._accepted[lane]
            if now_ns - accepted_ns <= self.config.command_timeout * 1e9:
                wanted = self._within_speed(velocity)
        before_ns = now_ns if self._limited_ns is None else self._limited_ns
        step_s = min(max(now_ns - before_ns, 1) * 1e-9, _LONGEST_STEP_S)
        self._limited_ns = now_ns
        return Velocity(
            *(limiter.limit(each, step_s) for limiter, each in zip(self._limiters, wanted, strict=True))
        )

    def _judge(self, lane: Lane, sender: Hashable, twist: Sequence[float], now_ns: int) -> Verdict:
        if not all(map(math.isfinite, twist)):
            return Verdict.NOT_FINITE
        if self.stopped_by is not None:
            return Verdict.STOPPED
        if lane is Lane.AUTONOMY and self.in_charge(now_ns) is Lane.OPERATOR:
            return Verdict.OVERRIDDEN
        latest = self._accepted.get(lane)
        if latest is None or latest[0] == sender or now_ns - latest[2] > self._holds[lane] * 1e9:
            return Verdict.ACCEPTED
        return Verdict.RIVAL

    def _within_speed(self, velocity: Velocity) -> Velocity:
        """Return a velocity in the same direction that is no faster over ground than the robot may be."""
        speed, most = math.hypot(velocity.x, velocity.y), self.config.linear.max_velocity
        scale = most / speed if speed > most else 1.0
        return Velocity(scale * velocity.x, scale * velocity.y, velocity.yaw)

    def _stamps(self, lane: Lane, sender: Hashable) -> SenderStamps:
        key = (lane, sender)
        found = self._senders.setdefault(key, SenderStamps(round(self.config.max_age * 1e9)))
        self._senders.move_to_end(key)
        if len(self._senders) > _MOST_SENDERS:
            self._senders.popitem(last=False)
        return found

    @property
    def _holds(self) -> dict[Lane, float]:
        return {Lane.AUTONOMY: self.config.command_timeout, Lane.OPERATOR: self.config.operator_hold}

    def _halt(self) -> None:
        """Stand still, and forget what was commanded, but not its stamps: nothing is ever done again."""
        priorities = {Lane.AUTONOMY: 10, Lane.OPERATOR: 100}
        self._mux = TwistMux(
            [
                MuxInput(name=lane, topic="", priority=priorities[lane], timeout=hold)
                for lane, hold in self._holds.items()
            ]
        )
        self._accepted: dict[Lane, tuple[Hashable, Velocity, int]] = {}
        linear, angular = self.config.linear, self.config.angular
        self._limiters = [SpeedLimiter(limits) for limits in (linear, linear, angular)]
