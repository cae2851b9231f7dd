"""A scenario's overrides put over a config."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

from twin.errors import ScenarioError

C = TypeVar("C")


def overridden(config: C, overrides: Mapping[str, Any]) -> C:
    """Return a config with those overrides that are fields of its own and are given; mappings go inwards.

    Raises:
        ScenarioError: they cannot be together.
    """
    own = {field.name for field in fields(config)}  # type: ignore[arg-type]
    given = {key: value for key, value in overrides.items() if key in own and value is not None}
    for key, value in given.items():
        inner = getattr(config, key)
        if isinstance(value, Mapping) and is_dataclass(inner):
            given[key] = overridden(inner, value)
    try:
        return replace(config, **given)  # type: ignore[type-var]
    except ValueError as error:
        raise ScenarioError(str(error)) from error
