"""What a scenario may override of the global planner; names are those of Nav2's plugins."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import model_validator

from twin.navigation.planning.config import CommitmentConfig, GoalAccessConfig
from twin.navigation.plugins import PLANNERS, SMOOTHERS, configs_of
from twin.nodes.navigation.planning.config import PlannerServerConfig
from twin.scenario.parameter_group import ParameterGroup, key_names, keys_of
from twin.scenario.plugin_groups import PluginGroup, plugin_name


@keys_of(PlannerServerConfig, CommitmentConfig, GoalAccessConfig)
class PlannerServerParameters(ParameterGroup):
    """What holds for every planner."""

    plugin: plugin_name(PLANNERS) = "theta_star"  # type: ignore[valid-type]
    """8-connected A* (`grid_based`); any-angle Theta* (`theta_star`); Hybrid-A* for robots with a turning
    circle (`smac_hybrid`); or a plugin of yours, whose parameters stand beside it."""


_KEYS = {plugin: key_names(config) for plugin, config in configs_of(PLANNERS).items()}


@keys_of(*configs_of(PLANNERS).values())
class PlannerParameters(PluginGroup, PlannerServerParameters):
    """Parameters of `/planner_server`: which planner `GridBased` is, and that planner's own."""

    of = PLANNERS

    @classmethod
    def beside(cls, data: Mapping[str, Any]) -> set[str]:
        """Return the keys of the server."""
        return set(PlannerServerParameters.model_fields)

    @classmethod
    def _descriptions(cls) -> Mapping[str, str]:
        """Return what is told of the keys, and which plugins have them."""
        told = dict(super()._descriptions())
        for name in told:
            owners = [f"`{plugin}`" for plugin, own in _KEYS.items() if name in own]
            if 0 < len(owners) < len(_KEYS):
                told[name] = f"{' and '.join(owners)}: {told[name]}"
        return told

    @model_validator(mode="after")
    def _belongs_to_the_plugin(self) -> PlannerParameters:
        if self.users is not None:
            return self
        valid = {*PlannerServerParameters.model_fields, *_KEYS[self.plugin]}
        for name in sorted(self.model_fields_set - valid):
            others = " or ".join(plugin for plugin, own in _KEYS.items() if name in own)
            raise ValueError(
                f"{name} is a parameter of {others}; {self.plugin} has {', '.join(sorted(valid))}"
            )
        return self


@keys_of(*configs_of(SMOOTHERS).values())
class SmootherParameters(PluginGroup):
    """Parameters of `/smoother_server`: its first smoother, which also smooths what a planner has planned."""

    of = SMOOTHERS
    plugin: plugin_name(SMOOTHERS) = "simple_smoother"  # type: ignore[valid-type]
    """`simple_smoother`, `savitzky_golay`, or a plugin of yours, whose parameters stand beside it."""

    @classmethod
    def beside(cls, data: Mapping[str, Any]) -> set[str]:
        """Return the key that names the plugin."""
        return {"plugin"}
