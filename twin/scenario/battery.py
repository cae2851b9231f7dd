"""The battery of a robot; names are those of gz-sim's LinearBatteryPlugin."""

from __future__ import annotations

from twin.scenario.parameter_group import ParameterGroup, keys_of
from twin.sim.battery import BatteryConfig


@keys_of(BatteryConfig)
class BatteryParameters(ParameterGroup):
    """A battery, or changes to the one that the robot's file describes."""
