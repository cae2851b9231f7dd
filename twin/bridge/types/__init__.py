"""Message types by name: their classes, their hashes, and the definitions that no library holds.

The types come from rosbags' Jazzy store, from the texts under `interfaces/` (fields and constants of the
Jazzy branches of the packages they are named after), from a user's .msg, .srv and .action files
(`add_folder`), from texts (`register`) and from descriptions that nodes send (`type_description`). Texts
are parsed when first used.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np

from twin.bridge.types import type_store
from twin.bridge.types.literals import Value
from twin.bridge.types.type_hash import known_hashes, rihs01_of
from twin.bridge.types.type_names import dds_name as dds_name
from twin.bridge.types.type_names import from_dds_name as from_dds_name
from twin.bridge.types.type_names import full_name as full_name
from twin.bridge.types.type_names import parts as parts
from twin.bridge.types.type_store import add_definitions as add_definitions
from twin.bridge.types.type_store import add_folder as add_folder
from twin.bridge.types.type_store import add_folders as add_folders
from twin.bridge.types.type_store import names as names
from twin.bridge.types.type_store import register as register
from twin.bridge.types.type_store import store as store
from twin.bridge.types.type_store import text_of as text_of
from twin.errors import BridgeError


def get(typename: str) -> type[Any]:
    """Return the class of a message or of a service's or action's part, as 'std_srvs/srv/Trigger_Request'.

    Raises:
        BridgeError: an unknown type; the message lists the package's types.
    """
    name = _loaded(typename)
    if name not in store.fielddefs:
        raise BridgeError(f"{name} is no message; its parts are, such as {name}_Request or {name}_Goal")
    return store.types[name]


def rihs01(typename: str) -> str:
    """Return a type's RIHS01 hash, 'RIHS01_<64 hex>', of a message, service or action.

    Raises:
        BridgeError: an unknown type.
    """
    name = full_name(typename)
    return known_hashes().get(name) or _computed_rihs01(name)


def definitions(typename: str) -> Mapping[str, Any]:
    """Return a mapping that has the fields of a type and of all that it uses, in rosbags' form.

    Raises:
        BridgeError: an unknown type.
    """
    _loaded(typename)
    return type_store.definitions


@dataclass(frozen=True)
class ServiceType:
    """A service; its classes are made when first asked for."""

    name: str
    """package/srv/Name, or package/action/Name_SendGoal."""

    @cached_property
    def Request(self) -> type[Any]:
        """The request's message class."""
        return get(f"{self.name}_Request")

    @cached_property
    def Response(self) -> type[Any]:
        """The response's message class."""
        return get(f"{self.name}_Response")


@dataclass(frozen=True)
class ActionType:
    """An action; its classes are made when first asked for."""

    name: str
    """package/action/Name."""

    @cached_property
    def Goal(self) -> type[Any]:
        """The goal's message class."""
        return get(f"{self.name}_Goal")

    @cached_property
    def Result(self) -> type[Any]:
        """The result's message class."""
        return get(f"{self.name}_Result")

    @cached_property
    def Feedback(self) -> type[Any]:
        """The feedback's message class."""
        return get(f"{self.name}_Feedback")

    @cached_property
    def FeedbackMessage(self) -> type[Any]:
        """The class of what travels on `<action>/_action/feedback`: goal_id and feedback."""
        return get(f"{self.name}_FeedbackMessage")

    @property
    def SendGoal(self) -> ServiceType:
        """The service that asks for a goal."""
        return ServiceType(f"{self.name}_SendGoal")

    @property
    def GetResult(self) -> ServiceType:
        """The service that answers when the goal has ended."""
        return ServiceType(f"{self.name}_GetResult")


def dtype_of(base: str) -> np.dtype[Any]:
    """Return the numpy type of the elements of an array of a base type other than string, as received."""
    return np.dtype({"char": "uint8", "byte": "int8", "octet": "int8"}.get(base, base))


def defaults(typename: str) -> dict[str, Value]:
    """Return the values of the fields that have a default other than zero."""
    return type_store.defaults.get(_loaded(typename), {})


def _loaded(typename: str) -> str:
    name = full_name(typename)
    type_store.load(name)
    return name


@cache
def _computed_rihs01(name: str) -> str:
    return rihs01_of(_loaded(name), type_store.definitions)
