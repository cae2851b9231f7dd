"""A scenario's overrides put over a config."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from twin.errors import ScenarioError
from twin.parameters import placed

C = TypeVar("C")


def overridden(config: C, overrides: Mapping[str, Any]) -> C:
    """Return a config with those overrides that are parameters of its own and are given; mappings go inwards.

    Raises:
        ScenarioError: they cannot be together.
    """
    try:
        return placed.overridden(config, overrides)
    except ValueError as error:
        raise ScenarioError(str(error)) from error
