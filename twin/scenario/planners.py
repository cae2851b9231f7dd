"""What a scenario may override of the global planner; names are those of Nav2's plugins."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from twin.navigation.planning.config import PLUGINS, CommitmentConfig, GoalAccessConfig
from twin.nodes.navigation.planning.config import PlannerServerConfig
from twin.scenario.parameter_group import ParameterGroup, group_of, keys_of


@keys_of(PlannerServerConfig, CommitmentConfig, GoalAccessConfig)
class PlannerServerParameters(ParameterGroup):
    """What holds for every planner."""

    plugin: Literal["grid_based", "theta_star", "smac_hybrid"] = "theta_star"
    """8-connected A*; any-angle Theta*; Hybrid-A* for robots with a turning circle."""


_KEYS = {plugin: group_of(config).model_fields for plugin, config in PLUGINS.items()}


@keys_of(*PLUGINS.values())
class PlannerParameters(PlannerServerParameters):
    """Parameters of `/planner_server`: which planner `GridBased` is, and that planner's own."""

    @model_validator(mode="after")
    def _belongs_to_the_plugin(self) -> PlannerParameters:
        valid = {*PlannerServerParameters.model_fields, *_KEYS[self.plugin]}
        for name in sorted(self.model_fields_set - valid):
            others = " or ".join(plugin for plugin, own in _KEYS.items() if name in own)
            raise ValueError(
                f"{name} is a parameter of {others}; {self.plugin} has {', '.join(sorted(valid))}"
            )
        return self


for _name, _field in PlannerParameters.model_fields.items():
    _owners = [f"`{plugin}`" for plugin, own in _KEYS.items() if _name in own]
    if 0 < len(_owners) < len(_KEYS):
        _field.description = f"{' and '.join(_owners)}: {_field.description}"
PlannerParameters.model_rebuild(force=True)
