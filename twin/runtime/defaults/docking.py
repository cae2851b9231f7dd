"""The docking server's parameters: what ships, under the scenario's docks and types."""

from __future__ import annotations

from dataclasses import replace

from twin.errors import ScenarioError
from twin.navigation.docking.docks import Dock, DockDatabase, DockError, DockType
from twin.nodes.navigation.docking.config import DockingServerConfig
from twin.scenario.docking import DockingParameters
from twin.warehouse.docks import DOCK_TYPES


def docking_config(group: DockingParameters) -> DockingServerConfig:
    """Return the config of `/docking_server`.

    Raises:
        ScenarioError: a dock of a type that there is not.
    """
    docks = {
        name: Dock(type=dock.type, frame=dock.frame, pose=dock.pose.pose)
        for name, dock in group.docks.items()
    }
    database = DockDatabase(types={**DOCK_TYPES, **DockDatabase().types}, docks=docks)
    config = with_scenario(DockingServerConfig(database=database), group)
    for name, dock in docks.items():
        try:
            config.database.type_of(dock.type)
        except DockError as error:
            raise ScenarioError(f"dock '{name}': {error}") from error
    return config


def with_scenario(config: DockingServerConfig, group: DockingParameters) -> DockingServerConfig:
    """Return a config with what a scenario gives of the server and of types of docks."""
    types = dict(config.database.types)
    for name, parameters in group.types.items():
        types[name] = parameters.over(types.get(name, DockType()))
    return group.over(replace(config, database=replace(config.database, types=types)))
