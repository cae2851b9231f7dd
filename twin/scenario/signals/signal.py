"""What a signal is: a value of each observation."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

from twin.errors import ScenarioError
from twin.parameters.units import Unit
from twin.scenario.observation import CheckContext, Observation, RobotObservation
from twin.scenario.temporal.formula import Value


class Signal(ABC):
    """A value of each observation of a run; it sees all of them, in order."""

    unit: ClassVar[str] = ""
    """Of its numbers, in SI: `m`, `m/s`; empty for those without one."""
    kind: ClassVar[type] = float
    """What its values are: `float`, `bool` or `str`."""
    takes: ClassVar[Sequence[tuple[str, Unit | None]]] = ()
    """Name and unit of each argument in parentheses; None: a text."""
    needs: ClassVar[str] = ""
    """The field of `RobotObservation` that is only known if somebody asks for it."""

    def __init__(self, robot: str | None, arguments: Sequence[float | str], context: CheckContext) -> None:
        """Take the robot that the file names, the arguments, one for each of `takes`, and what is known.

        Raises:
            ScenarioError: The signal does not exist in this run.
        """
        self.context = context

    @abstractmethod
    def value(self, observation: Observation) -> Value | None:
        """Return the value now; None if there is none, then the last one stays."""


class RobotSignal(Signal):
    """A signal of one robot."""

    def __init__(self, robot: str | None, arguments: Sequence[float | str], context: CheckContext) -> None:
        super().__init__(robot, arguments, context)
        self.robot = context.robot(robot)

    def value(self, observation: Observation) -> Value | None:
        """Return the value now."""
        return self.of(observation.robots[self.robot], observation.time_s)

    @abstractmethod
    def of(self, robot: RobotObservation, time_s: float) -> Value | None:
        """Return the value of what the robot does at a time [s]."""


def text_argument(arguments: Sequence[float | str], index: int = 0) -> str:
    """Return an argument that is a text."""
    argument = arguments[index]
    if not isinstance(argument, str):
        raise ScenarioError(f"the argument {argument} of a signal must be a name")
    return argument
