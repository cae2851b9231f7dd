"""What a scenario may override of a robot's path following; names are Nav2's.

The keys of every plugin stand side by side, as they do under FollowPath in a Nav2 file; one that the chosen
plugin does not have is refused.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from functools import cache
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from twin.navigation.control.dwb.config import DWBConfig, ScaleConfig
from twin.navigation.control.goal_checker import StoppedGoalCheckerConfig
from twin.navigation.control.mppi.config import CriticConfig, MPPIConfig
from twin.navigation.control.progress_checker import PoseProgressCheckerConfig
from twin.navigation.plugins import CONTROLLERS, CRITICS, GOAL_CHECKERS, PROGRESS_CHECKERS, configs_of
from twin.nodes.navigation.controller_server.config import ControllerServerConfig
from twin.parameters.declaration import fields_of
from twin.plugins import Kind
from twin.scenario.fields import faultless
from twin.scenario.parameter_group import ParameterGroup, key_names, keys_of
from twin.scenario.plugin_groups import PluginGroup, PluginListGroup, plugin_choice, plugin_name
from twin.scenario.plugins import PluginUse
from twin.strict_yaml import Fault


def _not_the_first(name: str) -> str:
    if name == "FollowPath":
        raise ValueError("'FollowPath' is what `controller` describes; take another name")
    return name


ControllerId = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$"), AfterValidator(_not_the_first)]
"""As in Nav2's controller_plugins."""


@keys_of(StoppedGoalCheckerConfig, later=True)
class GoalCheckerParameters(ParameterGroup):
    """Which goal checker, and its parameters."""

    goal_checker: plugin_choice(GOAL_CHECKERS) | None = None  # type: ignore[valid-type]
    """What a goal asks for: position and heading (`simple`), rest too (`stopped`), or `position` alone; a
    plugin of yours, or `{plugin: ...}` with its parameters; absent: `simple`."""


@keys_of(PoseProgressCheckerConfig, later=True)
class ProgressCheckerParameters(ParameterGroup):
    """Which progress checker, and its parameters."""

    progress_checker: plugin_choice(PROGRESS_CHECKERS) | None = None  # type: ignore[valid-type]
    """What progress is: a movement (`simple`), or a turn too (`pose`); a plugin of yours, or `{plugin: ...}`
    with its parameters; absent: `simple`."""


@keys_of(ControllerServerConfig, later=True)
class ServerParameters(ProgressCheckerParameters):
    """Parameters of the server: they hold for all controllers."""

    maneuvers: bool | None = None
    """Whether a robot that has stood blocked for 1.5 s, if `failure_tolerance` is longer, looks for moves to
    and fro that free it; absent: yes. Otherwise that is left to recoveries."""


class PluginParameters(GoalCheckerParameters):
    """What each controller has, whatever its plugin."""

    plugin: plugin_name(CONTROLLERS, "rotation_shim") | None = None  # type: ignore[valid-type]
    """What follows the path: `regulated_pure_pursuit`, `dwb`, `mppi`, or a plugin of yours, whose parameters
    stand beside it; absent: `regulated_pure_pursuit`."""
    rotation_shim: bool | None = None
    """Whether the robot turns in place to a path's direction, and at the goal; absent: with `dwb` and
    `mppi`."""


def _critic_names(controller: type, critic: type) -> list[str]:
    """Return the names of the critics that are compiled into a controller."""
    inside = fields_of(controller).values()
    return [one.name for one in inside if one.config is not None and issubclass(one.config, critic)]


@cache
def _of_plugins() -> dict[str, tuple[str, ...]]:
    """Return the keys of what ships, by its name."""
    return {name: key_names(config) for name, config in configs_of(CONTROLLERS).items()}


def _valid_with(name: str) -> str:
    """Return what a key needs beside it."""
    plugins = [plugin for plugin, names in _of_plugins().items() if name in names]
    return " or ".join(
        f"`{'rotation_shim: true' if p == 'rotation_shim' else f'plugin: {p}'}`" for p in plugins
    )


@keys_of(*configs_of(CONTROLLERS).values(), later=True)
class ControllerParameters(PluginGroup, PluginListGroup, PluginParameters, ServerParameters):
    """Parameters of `/controller_server`, of its checkers, and of the plugin that follows paths."""

    of, list_of, list_key = CONTROLLERS, CRITICS, "critics"

    @classmethod
    def beside(cls, data: Mapping[str, Any]) -> set[str]:
        """Return the keys of the server, the checkers, and the rotation shim if it is asked for."""
        shim = _of_plugins()["rotation_shim"] if data.get("rotation_shim") is True else ()
        return {*ServerParameters.whole().model_fields, *PluginParameters.whole().model_fields, *shim}

    @classmethod
    def ships(cls, data: Mapping[str, Any]) -> Collection[str] | None:
        """Return the names of the critics that ship for the plugin; None: it has no list of them."""
        plugin = data.get("plugin")
        critics = {"mppi": (MPPIConfig, CriticConfig), "dwb": (DWBConfig, ScaleConfig)}
        return _critic_names(*critics[plugin]) if plugin in critics else None

    @property
    def chosen(self) -> str:
        """The plugin, given or not."""
        return self.plugin or "regulated_pure_pursuit"

    @property
    def shim(self) -> bool:
        """Whether the rotation shim is in front of it."""
        return self.chosen in ("dwb", "mppi") if self.rotation_shim is None else self.rotation_shim

    @faultless
    def _foreign(self) -> Iterator[Fault]:
        if self.chosen == "rotation_shim":
            yield Fault(("plugin",), "the rotation shim stands before a plugin: write 'rotation_shim: true'")
            return
        valid = {*ServerParameters.whole().model_fields, *PluginParameters.whole().model_fields}
        used = [self.chosen] * (self.users is None) + ["rotation_shim"] * self.shim
        valid.update(*(_of_plugins()[plugin] for plugin in used))
        for name in type(self).model_fields:
            if name in self.model_fields_set and name not in valid:
                told = f"{self.chosen} {'with' if self.shim else 'without'} rotation shim"
                yield Fault((name,), f"'{name}' is not of {told}; valid with {_valid_with(name)}")

        kinds: dict[str, Kind[Any]] = {"goal_checker": GOAL_CHECKERS, "progress_checker": PROGRESS_CHECKERS}
        for key, configs in kinds.items():
            having = {kind: key_names(config) for kind, config in configs_of(configs).items()}
            chosen = getattr(self, key) or "simple"
            own = {} if isinstance(chosen, PluginUse) else having[chosen]
            for name in dict.fromkeys(name for names in having.values() for name in names):
                if name in self.model_fields_set and name not in own:
                    needed = " or ".join(
                        f"'{key}: {kind}'" for kind, names in having.items() if name in names
                    )
                    yield Fault((name,), f"'{name}' needs {needed} beside it")


@keys_of(later=True)
class FurtherControllerParameters(ControllerParameters):
    """Parameters of a controller beside FollowPath, and of a goal checker of the same name."""

    @faultless
    def _of_the_server(self) -> Iterator[Fault]:
        for name in sorted(self.model_fields_set & set(ServerParameters.whole().model_fields)):
            yield Fault((name,), f"'{name}' holds for all controllers: give it under `controller`")
