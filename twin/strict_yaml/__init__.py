"""Read a YAML file into a pydantic model and report every fault of the file at once, each with its line.

YAML is read with the core schema of YAML 1.2 (so `1e-3` is a number, `on` and `no` are text). Physical values
are SI numbers or text with a unit: `duration: 240` and `duration: 4 min` are the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import to_json

from twin.errors import TwinError
from twin.strict_yaml.document import Document, apply_override, read
from twin.strict_yaml.document import Loc as Loc
from twin.strict_yaml.explain import Fault as Fault
from twin.strict_yaml.explain import Faults as Faults
from twin.strict_yaml.explain import explain
from twin.strict_yaml.units import Hertz as Hertz
from twin.strict_yaml.units import Joules as Joules
from twin.strict_yaml.units import Kilograms as Kilograms
from twin.strict_yaml.units import Metres as Metres
from twin.strict_yaml.units import MetresPerSecond as MetresPerSecond
from twin.strict_yaml.units import Newtons as Newtons
from twin.strict_yaml.units import Radians as Radians
from twin.strict_yaml.units import RadiansPerSecond as RadiansPerSecond
from twin.strict_yaml.units import Seconds as Seconds

M = TypeVar("M", bound=BaseModel)


class StrictModel(BaseModel):
    """Base of every file schema: unknown keys are errors, values are frozen, docstrings describe."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True, str_min_length=1
    )


def _without(data: Any, locs: Sequence[Loc]) -> Any:
    """Return a deep copy of plain data without the values at some locations."""

    def copy(value: Any, loc: Loc) -> Any:
        if isinstance(value, dict):
            return {k: copy(v, (*loc, k)) for k, v in value.items() if (*loc, k) not in gone}
        if isinstance(value, list):
            return [copy(v, (*loc, i)) for i, v in enumerate(value)]
        return value

    gone = set(locs)
    return copy(data, ())


def _validate(schema: type[M], document: Document) -> M | None:
    """Validate, adding every fault to the document; a second pass finds faults behind the first ones."""
    context = {"folder": document.file.parent}
    found: dict[tuple[Loc, str], None] = {}
    data = document.data
    for _ in range(2):
        try:
            model = schema.model_validate_json(to_json(data), strict=True, context=context)
        except ValidationError as invalid:
            faults = [dict(fault) for fault in invalid.errors()]
        else:
            if not found:
                return model
            break
        bad = {loc for loc, _ in found}
        explained = [item for fault in faults for item in explain(schema, data, fault)]
        found |= {(loc, text): None for loc, text in explained if loc not in bad}
        data = _without(document.data, [loc for loc, _ in found])
    document.problems += [document.problem(loc, text) for loc, text in found]
    return None


def load(
    path: Path,
    schema: type[M],
    *,
    error: type[TwinError],
    overrides: Mapping[str, str] = MappingProxyType({}),
) -> M:
    """Read a YAML file into `schema`.

    Args:
        path: The file.
        schema: A pydantic model, best a `StrictModel`; its validators may raise `Faults` and find the file's
            folder as `info.context["folder"]`.
        error: What to raise.
        overrides: Dotted path to YAML text, e.g. `{"robots.0.pose.yaw": "90 deg"}`.

    Raises:
        TwinError: As `error`, with every problem of the file and of the overrides, in file order.
    """
    document = read(path, error)
    for dotted, text in overrides.items():
        apply_override(document, dotted, text)
    model = _validate(schema, document)
    if model is None or document.problems:
        raise error(sorted(document.problems, key=lambda p: (p.line is None, p.line or 0)))
    return model
