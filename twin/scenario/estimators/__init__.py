"""What a scenario may override of the nodes that estimate a pose: a module for each, loaded when needed."""

from __future__ import annotations

from typing import ClassVar, Self

from pydantic import model_validator

from twin.parameters.placed import overridden
from twin.scenario.parameter_group import ParameterGroup


class Checked(ParameterGroup):
    """Parameters that must fit together, and to the defaults of a config."""

    among: ClassVar[type]

    @model_validator(mode="after")
    def _can_be(self) -> Self:
        overridden(self.among(), self.overrides())
        return self
