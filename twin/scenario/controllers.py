"""What a scenario may override of a robot's path following; names are Nav2's.

The keys of every plugin stand side by side, as they do under FollowPath in a Nav2 file; one that the chosen
plugin does not have is refused.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from twin.navigation.control.dwb.config import DWBConfig
from twin.navigation.control.goal_checker import (
    GoalCheckerConfig,
    PositionGoalCheckerConfig,
    StoppedGoalCheckerConfig,
)
from twin.navigation.control.mppi.config import MPPIConfig
from twin.navigation.control.progress_checker import PoseProgressCheckerConfig, ProgressCheckerConfig
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
from twin.navigation.control.rotation_shim_config import RotationShimConfig
from twin.nodes.navigation.controller_server.config import ControllerServerConfig
from twin.scenario.parameter_group import ParameterGroup, group_of, keys_of
from twin.strict_yaml import Fault, Faults


def _not_the_first(name: str) -> str:
    if name == "FollowPath":
        raise ValueError("'FollowPath' is what `controller` describes; take another name")
    return name


ControllerId = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$"), AfterValidator(_not_the_first)]
"""As in Nav2's controller_plugins."""
Plugin = Literal["regulated_pure_pursuit", "dwb", "mppi"]
GOAL_CHECKERS: Mapping[str, type[PositionGoalCheckerConfig]] = MappingProxyType(
    {
        "simple": GoalCheckerConfig,
        "stopped": StoppedGoalCheckerConfig,
        "position": PositionGoalCheckerConfig,
    }
)
PROGRESS_CHECKERS: Mapping[str, type[ProgressCheckerConfig]] = MappingProxyType(
    {"simple": ProgressCheckerConfig, "pose": PoseProgressCheckerConfig}
)


@keys_of(StoppedGoalCheckerConfig)
class GoalCheckerParameters(ParameterGroup):
    """Which goal checker, and its parameters."""

    goal_checker: Literal["simple", "stopped", "position"] | None = None
    """What a goal asks for: position and heading, rest too, or position alone; absent: `simple`."""


@keys_of(PoseProgressCheckerConfig)
class ProgressCheckerParameters(ParameterGroup):
    """Which progress checker, and its parameters."""

    progress_checker: Literal["simple", "pose"] | None = None
    """What progress is: a movement, or a turn too; absent: `simple`."""


@keys_of(ControllerServerConfig)
class ServerParameters(ProgressCheckerParameters):
    """Parameters of the server: they hold for all controllers."""

    maneuvers: bool | None = None
    """Whether a robot that has stood blocked for 1.5 s, if `failure_tolerance` is longer, looks for moves to
    and fro that free it; absent: yes. Otherwise that is left to recoveries."""


class PluginParameters(GoalCheckerParameters):
    """What each controller has, whatever its plugin."""

    plugin: Plugin | None = None
    """What follows the path; absent: `regulated_pure_pursuit`."""
    rotation_shim: bool | None = None
    """Whether the robot turns in place to a path's direction, and at the goal; absent: with all but regulated
    pure pursuit, which does that itself."""


_OF_PLUGIN = {
    "regulated_pure_pursuit": group_of(RegulatedPurePursuitConfig),
    "dwb": group_of(DWBConfig),
    "mppi": group_of(MPPIConfig),
}
_OF_SHIM = group_of(RotationShimConfig)


def _valid_with(name: str) -> str:
    """Return what a key needs beside it."""
    owners = [f"`plugin: {plugin}`" for plugin, group in _OF_PLUGIN.items() if name in group.model_fields]
    if name in _OF_SHIM.model_fields:
        owners.append("`rotation_shim: true`")
    return " or ".join(owners)


@keys_of(RegulatedPurePursuitConfig, RotationShimConfig, DWBConfig, MPPIConfig)
class ControllerParameters(PluginParameters, ServerParameters):
    """Parameters of `/controller_server`, of its checkers, and of the plugin that follows paths."""

    @property
    def chosen(self) -> Plugin:
        """The plugin, given or not."""
        return self.plugin or "regulated_pure_pursuit"

    @property
    def shim(self) -> bool:
        """Whether the rotation shim is in front of it."""
        return self.chosen != "regulated_pure_pursuit" if self.rotation_shim is None else self.rotation_shim

    @model_validator(mode="after")
    def _keys_of_the_plugin(self) -> ControllerParameters:
        faults = list(self._foreign())
        if faults:
            raise Faults(faults)
        return self

    def _foreign(self) -> Iterator[Fault]:
        groups: list[type[ParameterGroup]] = [
            ServerParameters,
            PluginParameters,
            _OF_PLUGIN[self.chosen],
            *([_OF_SHIM] if self.shim else []),
        ]
        valid = {name for group in groups for name in group.model_fields}
        for name in type(self).model_fields:
            if name in self.model_fields_set and name not in valid:
                told = f"{self.chosen} {'with' if self.shim else 'without'} rotation shim"
                yield Fault((name,), f"'{name}' is not of {told}; valid with {_valid_with(name)}")

        for key, configs in (("goal_checker", GOAL_CHECKERS), ("progress_checker", PROGRESS_CHECKERS)):
            having = {kind: group_of(config).model_fields for kind, config in configs.items()}
            for name in dict.fromkeys(name for names in having.values() for name in names):
                if name in self.model_fields_set and name not in having[getattr(self, key) or "simple"]:
                    needed = " or ".join(
                        f"'{key}: {kind}'" for kind, names in having.items() if name in names
                    )
                    yield Fault((name,), f"'{name}' needs {needed} beside it")


class FurtherControllerParameters(ControllerParameters):
    """Parameters of a controller beside FollowPath, and of a goal checker of the same name."""

    @model_validator(mode="after")
    def _keys_of_no_server(self) -> FurtherControllerParameters:
        faults = [
            Fault((name,), f"'{name}' holds for all controllers: give it under `controller`")
            for name in sorted(self.model_fields_set & set(ServerParameters.model_fields))
        ]
        if faults:
            raise Faults(faults)
        return self
