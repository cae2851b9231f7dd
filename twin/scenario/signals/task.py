"""How a robot's navigator and the mission get on."""

from __future__ import annotations

from twin.scenario.observation import Observation, RobotObservation
from twin.scenario.signals.signal import RobotSignal, Signal


class Goals(RobotSignal):
    """Goals that the navigator has taken so far."""

    def of(self, robot: RobotObservation, time_s: float) -> float:
        """Return how many."""
        return float(robot.goals)


class Recoveries(RobotSignal):
    """Recovery behaviours that the navigator has started so far."""

    def of(self, robot: RobotObservation, time_s: float) -> float:
        """Return how many."""
        return float(robot.recoveries)


class TimeInRecoveries(RobotSignal):
    """Time that the navigator has spent in recovery behaviours so far."""

    unit = "s"
    _spent = 0.0
    _last: tuple[float, bool] | None = None

    def of(self, robot: RobotObservation, time_s: float) -> float:
        """Return it [s]."""
        if self._last is not None and self._last[1]:
            self._spent += time_s - self._last[0]
        self._last = (time_s, robot.recovering)
        return self._spent


class MissionState(Signal):
    """The state of the mission."""

    kind = str

    def value(self, observation: Observation) -> str:
        """Return it."""
        return observation.mission_state


class MissionDone(Signal):
    """Whether the mission has ended."""

    kind = bool

    def value(self, observation: Observation) -> bool:
        """Return whether it has."""
        return observation.mission_done


class MissionSucceeded(Signal):
    """Whether the mission has ended well."""

    kind = bool

    def value(self, observation: Observation) -> bool:
        """Return whether it has."""
        return bool(observation.mission_succeeded)
