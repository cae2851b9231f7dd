"""Read a YAML file into a pydantic model and report every fault of the file at once, each with its line.

YAML is read with the core schema of YAML 1.2 (so `1e-3` is a number, `on` and `no` are text). Physical values
are SI numbers or text with a unit: `duration: 240` and `duration: 4 min` are the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, GetJsonSchemaHandler
from pydantic_core import CoreSchema

from twin.errors import TwinError
from twin.parameters.texts import texts_of
from twin.strict_yaml.document import Document as Document
from twin.strict_yaml.document import Loc as Loc
from twin.strict_yaml.document import apply_override as apply_override
from twin.strict_yaml.document import read as read
from twin.strict_yaml.explain import Fault as Fault
from twin.strict_yaml.explain import Faults as Faults
from twin.strict_yaml.explain import findings as findings
from twin.strict_yaml.explain import validate

M = TypeVar("M", bound=BaseModel)


class StrictModel(BaseModel):
    """Base of every file schema: unknown keys are errors, values are frozen, docstrings describe."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, str_min_length=1, defer_build=True
    )

    @classmethod
    def _descriptions(cls) -> Mapping[str, str]:
        """Return what is told of the keys. It is read from the source, so only when somebody asks."""
        return texts_of(cls)

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        reference = handler(core)
        properties = handler.resolve_ref_schema(reference).get("properties", {})
        for name, text in cls._descriptions().items():
            if name in properties:
                properties[name].setdefault("description", text)
        return reference


def load(
    path: Path,
    schema: type[M],
    *,
    error: type[TwinError],
    overrides: Mapping[str, str] = MappingProxyType({}),
    context: Mapping[str, Any] = MappingProxyType({}),
) -> M:
    """Read a YAML file into `schema`.

    Args:
        path: The file.
        schema: A pydantic model, best a `StrictModel`; its validators may raise `Faults` and find the file's
            folder as `info.context["folder"]`.
        error: What to raise.
        overrides: Dotted path to YAML text, e.g. `{"robots.0.pose.yaw": "90 deg"}`.
        context: What else validators find in `info.context`.

    Raises:
        TwinError: As `error`, with every problem of the file and of the overrides, in file order.
    """
    return checked(read(path, error), schema, error=error, overrides=overrides, context=context)


def checked(
    document: Document,
    schema: type[M],
    *,
    error: type[TwinError],
    overrides: Mapping[str, str] = MappingProxyType({}),
    context: Mapping[str, Any] = MappingProxyType({}),
) -> M:
    """Return a model of what was read, or is kept as plain data; the overrides go into it. See `load`."""
    for dotted, text in overrides.items():
        apply_override(document, dotted, text)
    model = validate(schema, document, context)
    if model is None or document.problems:
        raise error(sorted(document.problems, key=lambda p: (p.line is None, p.line or 0)))
    return model
