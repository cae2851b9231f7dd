"""What goes wrong during a run: a class for each kind, which acts where hardware or network would fail."""

from twin.faults.fault import Effect, Fault
from twin.scenario.faults import FaultConfig, LastingFault, LastingRobotFault, RobotFault

__all__ = ["Effect", "Fault", "FaultConfig", "LastingFault", "LastingRobotFault", "RobotFault"]
