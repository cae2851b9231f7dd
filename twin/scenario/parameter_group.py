"""Overrides of a node's parameters in a scenario."""

from __future__ import annotations

from typing import Any

from twin.strict_yaml import StrictModel


class ParameterGroup(StrictModel):
    """Parameters of one node; a key that is absent keeps the node's default."""

    def overrides(self) -> dict[str, Any]:
        """Return only the parameters that the file gives, by name."""
        return {name: getattr(self, name) for name in self.model_fields_set}
