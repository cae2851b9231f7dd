"""From a `RobotDescription` to a MuJoCo model, with a ledger of what became of every element."""

from twin.convert import mujoco_log as mujoco_log
from twin.convert.bodies import Base
from twin.convert.conversion import Conversion, Guess
from twin.convert.convert import convert

__all__ = ["Base", "Conversion", "Guess", "convert"]
