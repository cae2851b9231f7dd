"""The docks of a robot; names are opennav_docking's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

from twin.navigation.docking.docks import DockType
from twin.nodes.navigation.docking.config import DockingServerConfig
from twin.scenario.fields import PoseConfig
from twin.scenario.parameter_group import ParameterGroup, keys_of
from twin.strict_yaml import StrictModel
from twin.strict_yaml.later import Later


@keys_of(DockType, later=True)
class DockTypeParameters(ParameterGroup):
    """A kind of docks, or changes to one that ships: charger, shelf, table, tote."""


class DockConfig(StrictModel):
    """One dock."""

    type: str
    """One that ships, or of `types`."""
    frame: str = "map"
    """Of the pose."""
    pose: PoseConfig
    """Where the base stands when docked."""


@keys_of(DockingServerConfig, later=True)
class DockingParameters(ParameterGroup):
    """Parameters of `/docking_server`."""

    types: Mapping[str, Annotated[DockTypeParameters, Later(DockTypeParameters.whole)]] = {}
    """Kinds of docks by name."""
    docks: Mapping[str, DockConfig] = {}
    """Docks by the name that `dock_robot` has in `dock_id`."""
