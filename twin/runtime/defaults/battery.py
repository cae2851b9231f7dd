"""The battery of a robot: what its file says, under what the scenario does."""

from __future__ import annotations

from dataclasses import fields, replace

from twin.models.specs import BatterySpec
from twin.scenario.battery import BatteryParameters
from twin.sim.battery import BatteryConfig


def battery_config(spec: BatterySpec | None, given: BatteryParameters | None) -> BatteryConfig | None:
    """Return the battery of a robot; None: nobody speaks of one.

    Raises:
        ScenarioError: The scenario's values do not fit those of the file, or each other.
    """
    if spec is None:
        return None if given is None else given.over(BatteryConfig())
    config = _of_file(spec)
    return config if given is None else given.over(config)


def _of_file(spec: BatterySpec) -> BatteryConfig:
    """Return what the file says; where it is silent there is no load and no resistance, as in Gazebo.

    Without coefficients of the open-circuit voltage that is `voltage`, which in Gazebo would be 0 then.
    """
    silent = BatteryConfig(
        open_circuit_voltage_linear_coef=0.0,
        resistance=0.0,
        power_load=0.0,
    )
    said = {name: getattr(spec, name, None) for name in (field.name for field in fields(BatteryConfig))}
    return replace(silent, **{name: value for name, value in said.items() if value is not None})
