"""The docking server's parameters: what ships, under the scenario's docks and types."""

from __future__ import annotations

from twin.errors import ScenarioError
from twin.navigation.docking.docks import Dock, DockDatabase, DockError, DockType
from twin.nodes.navigation.docking.config import DockingServerConfig
from twin.runtime.defaults.overrides import overridden
from twin.scenario.docking import DockingParameters
from twin.warehouse.docks import DOCK_TYPES


def docking_config(group: DockingParameters) -> DockingServerConfig:
    """Return the config of `/docking_server`.

    Raises:
        ScenarioError: a dock of a type that there is not.
    """
    own = {**DOCK_TYPES, **DockDatabase().types}
    changed = {
        name: overridden(own.get(name, DockType()), parameters.overrides())
        for name, parameters in group.types.items()
    }
    docks = {
        name: Dock(type=dock.type, frame=dock.frame, pose=dock.pose.pose)
        for name, dock in group.docks.items()
    }
    database = DockDatabase(types={**own, **changed}, docks=docks)
    for name, dock in docks.items():
        try:
            database.type_of(dock.type)
        except DockError as error:
            raise ScenarioError(f"dock '{name}': {error}") from error
    return overridden(DockingServerConfig(database=database), group.overrides())
