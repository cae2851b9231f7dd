"""Whether values of a Nav2 parameter file can be: by what a scenario may give under the same names."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import Any, get_args, get_origin

from pydantic import BaseModel, TypeAdapter, ValidationError

from twin.runtime.parameter_files.nav2.names import local_name

_SENTINELS = ("failure_tolerance",)
"""Negative values of these have a meaning of their own."""


def why_not(model: type[BaseModel], name: str, value: Any) -> str:
    """Return why a value cannot be; '' if it can, or if scenarios do not have its name.

    Args:
        model: What a scenario may give.
        name: Of the parameter, without sections but those of `model`: 'CostCritic.cost_weight',
            'sources.imu0.config'.
        value: As the file has it, of the right type.
    """
    *sections, last = name.split(".")
    parts = iter(sections)
    for section in parts:
        field = model.model_fields.get(section)
        inner = None if field is None else field.annotation
        if get_origin(inner) is Mapping:
            next(parts, None)  # the key: any
            inner = get_args(inner)[1]
        if not (isinstance(inner, type) and issubclass(inner, BaseModel)):
            return ""
        model = inner
    field = model.model_fields.get(last)
    if field is None or (last in _SENTINELS and isinstance(value, int | float) and value < 0.0):
        return ""
    try:
        adapter: TypeAdapter[Any] = TypeAdapter(field.rebuild_annotation())
        adapter.validate_python(value)
    except ValidationError as error:
        return said_of(error)
    return ""


def refusals(model: type[BaseModel], values: Mapping[str, Any], refused: Mapping[str, str]) -> dict[str, str]:
    """Return why values cannot be, by name.

    Args:
        model: What a scenario may give.
        values: By the names that the node has.
        refused: Why the node's config did not take some of them.
    """
    found = {name: why_not(model, local_name(name), value) for name, value in values.items()}
    impossible = {name: why for name, why in found.items() if why}
    # Of a wrong type the config says more; else what a scenario may give tells which value it is.
    of_type = {name: why for name, why in refused.items() if why.startswith("must ")}
    return {**refused, **impossible, **of_type}


def sentence(node: str, name: str, why: str) -> str:
    """Return why a value cannot be, with node and name told once."""
    if why.startswith(f"{node}: "):
        return why
    return f"{node}: {why[why.index(name) :]}" if name in why else f"{node}: {name} {why}"


def said_of(error: ValidationError) -> str:
    """Return a schema's first fault as the end of a sentence."""
    first = error.errors()[0]
    if first["type"] == "missing":
        return "is missing"
    if first["type"] in ("too_short", "too_long"):
        least = first["ctx"].get("min_length", first["ctx"].get("max_length"))
        return f"must have {least} values, not {first['ctx']['actual_length']}"
    said = first["msg"].removeprefix("Value error, ").replace("Input should be", "must be")
    return said if isinstance(first["input"], list | tuple) else f"{said}, not {first['input']!r}"


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
