"""Values of a script for the keys of a scenario."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from twin.errors import ScenarioError
from twin.scenario import schema


def read_scenario(
    scenario: schema.Scenario | str | Path,
    overrides: Mapping[str, Any] = MappingProxyType({}),
    *,
    execute: bool = False,
) -> schema.Scenario:
    """Read a scenario; see `twin.load_scenario`.

    Raises:
        ScenarioError: With every problem of the file and of the overrides, each with its line.
    """
    if isinstance(scenario, schema.Scenario):
        if overrides:
            raise ScenarioError(
                f"scenario '{scenario.name}' is read already; give overrides to load_scenario, "
                "or the file instead of the scenario"
            )
        return scenario
    texts = {key: as_yaml(value) for key, value in overrides.items()}
    return schema.load(scenario, texts, execute=execute)


def as_yaml(value: Any) -> str:
    """Return a value as in a file (JSON is YAML); text is taken as it is, as that of `twin run --set`."""
    if isinstance(value, str):
        return value
    return json.dumps(value, default=lambda other: other.tolist() if hasattr(other, "tolist") else str(other))
