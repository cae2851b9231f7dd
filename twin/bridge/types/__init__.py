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
from twin.bridge.types.parser import Definition
from twin.bridge.types.type_hash import FieldDefs, rihs01_of
from twin.bridge.types.type_names import Parts, dds_name, from_dds_name, parts
from twin.bridge.types.type_store import add_folder, add_folders, store
from twin.errors import BridgeError


def register(typename: str, text: str) -> None:
    """Make a type known by its definition, as in a .msg, .srv or .action file; types it uses may come later.

    Raises:
        BridgeError: the text is no definition, or the name is taken by one with other fields.
    """
    type_store.add(Definition("/".join(parts(typename)), text))


def get(typename: str) -> type[Any]:
    """Return the class of a message or of a service's or action's part, as 'std_srvs/srv/Trigger_Request'.

    Raises:
        BridgeError: an unknown type; the message lists the package's types.
    """
    name = "/".join(parts(typename))
    type_store.load(name)
    if name not in store.types:
        raise BridgeError(f"{name} is no message; its parts are, such as {name}_Request or {name}_Goal")
    return store.types[name]


def rihs01(typename: str) -> str:
    """Return a type's RIHS01 hash, 'RIHS01_<64 hex>', of a message, service or action.

    Raises:
        BridgeError: an unknown type.
    """
    name = "/".join(parts(typename))
    type_store.load(name)
    return _rihs01(name)


def definitions(typename: str) -> Mapping[str, Any]:
    """Return a mapping that has the fields of a type and of all that it uses, in rosbags' form.

    Raises:
        BridgeError: an unknown type.
    """
    type_store.load("/".join(parts(typename)))
    return type_store.definitions


def add_definitions(definitions: FieldDefs, defaults: Mapping[str, dict[str, Value]]) -> None:
    """Make types known by their fields, in rosbags' form; every type that they use must be among them.

    Args:
        definitions: type name -> (constants, fields).
        defaults: type name -> field -> default value.

    Raises:
        BridgeError: a type that is already known with other fields.
    """
    type_store.add_fields(definitions, defaults)


def text_of(typename: str) -> str | None:
    """Return a definition's text, or None for a part of a service or an action, which has none of its own.

    Raises:
        BridgeError: an unknown type.
    """
    return type_store.text_of("/".join(parts(typename)))


def names() -> list[str]:
    """Return every message, service and action that has a name here, sorted."""
    return type_store.names()


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
    name = "/".join(parts(typename))
    type_store.load(name)
    return type_store.defaults.get(name, {})


@cache
def _rihs01(name: str) -> str:
    return rihs01_of(name, type_store.definitions)


__all__ = [
    "ActionType",
    "Parts",
    "ServiceType",
    "add_definitions",
    "add_folder",
    "add_folders",
    "dds_name",
    "defaults",
    "definitions",
    "dtype_of",
    "from_dds_name",
    "get",
    "names",
    "parts",
    "register",
    "rihs01",
    "store",
    "text_of",
]
