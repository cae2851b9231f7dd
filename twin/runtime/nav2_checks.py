"""Whether values of a Nav2 parameter file can be: by what a scenario may give under the same names."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from typing import Annotated, Any

from pydantic import BaseModel, Field, TypeAdapter, ValidationError

_MoreThanZero = Annotated[float, Field(gt=0.0)]


class _AxisParameters(BaseModel):
    max_acceleration: _MoreThanZero
    max_deceleration: _MoreThanZero


class VelocitySmootherParameters(BaseModel):
    """What a scenario has no keys for: a robot that cannot brake is none."""

    linear: _AxisParameters
    angular: _AxisParameters


class NavigatorParameters(BaseModel):
    """Of `/bt_navigator`."""

    bt_loop_duration: Annotated[int, Field(gt=0)]


class WaypointFollowerParameters(BaseModel):
    """Of `/waypoint_follower`."""

    loop_rate: _MoreThanZero


_SENTINELS = ("failure_tolerance",)
"""A negative value of these means that there is no limit."""


def why_not(model: type[BaseModel], name: str, value: Any) -> str:
    """Return why a value cannot be; '' if it can, or if scenarios do not have its name.

    Args:
        model: What a scenario may give.
        name: Of the parameter, without sections but those of `model`: 'CostCritic.cost_weight'.
        value: As the file has it, of the right type.
    """
    *sections, last = name.split(".")
    for section in sections:
        field = model.model_fields.get(section)
        inner = None if field is None else field.annotation
        if not (isinstance(inner, type) and issubclass(inner, BaseModel)):
            return ""
        model = inner
    field = model.model_fields.get(last)
    if field is None or (last in _SENTINELS and value == -1.0):
        return ""
    try:
        adapter: TypeAdapter[Any] = TypeAdapter(field.rebuild_annotation())
        adapter.validate_python(value)
    except ValidationError as error:
        return said_of(error)
    return ""


def said_of(error: ValidationError) -> str:
    """Return a schema's first fault as the end of a sentence."""
    first = error.errors()[0]
    if first["type"] == "missing":
        return "is missing"
    said = first["msg"].removeprefix("Value error, ").replace("Input should be", "must be")
    return f"{said}, not {first['input']!r}"


def wrong_critics(names: Sequence[str], valid: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return which critics are likely mistakes, each with what was meant, and which are Nav2's alone."""
    mistakes, absent = [], []
    for name in names:
        if name in valid:
            continue
        close = difflib.get_close_matches(name, valid, n=1, cutoff=0.85)
        if close:
            mistakes.append(f"has no critic '{name}'; did you mean '{close[0]}'?")
        else:
            absent.append(name)
    return mistakes, absent
