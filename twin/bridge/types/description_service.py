"""`~/get_type_description`: what a type is, for who knows only its name and hash (REP-2016)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from twin.bridge import types
from twin.bridge.types import ServiceType
from twin.bridge.types.default_values import new
from twin.errors import BridgeError

GetTypeDescription = ServiceType("type_description_interfaces/srv/GetTypeDescription")

_NOT_IN_USE = "Type not currently in use by this node"  # rcl's words, in node.c


def offered() -> dict[str, tuple[ServiceType, Callable[[Any], Any]]]:
    """Return the service: name below the node -> type and callback."""
    return {"get_type_description": (GetTypeDescription, _answer)}


def _answer(request: Any) -> Any:
    from twin.bridge.types import description as type_description

    response = GetTypeDescription.Response
    if request.type_hash and not request.type_hash.startswith("RIHS01_"):
        return new(response, failure_reason="Failed to parse type hash")
    try:
        if request.type_hash and types.rihs01(request.type_name) != request.type_hash:
            return new(response, failure_reason=_NOT_IN_USE)
        description = type_description.describe(request.type_name)
        sources = type_description.sources(request.type_name) if request.include_type_sources else []
    except BridgeError as error:
        return new(response, failure_reason=f"{_NOT_IN_USE}: {error}")
    return new(response, successful=True, type_description=description, type_sources=sources)
