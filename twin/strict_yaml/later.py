"""Models that are imported, and made, only if a file has what they describe."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import Annotated, Any

from pydantic import BaseModel, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, core_schema, to_json

Model = type[BaseModel]


def later(model: str | Callable[[], Model]) -> Any:
    """Return the type of a key whose model is `module:Class`, or what a function returns."""
    return Annotated[Any, Later(partial(found, model) if isinstance(model, str) else model)]


def found(target: str) -> Model:
    """Return the model that is `module:Class`."""
    module, _, name = target.partition(":")
    model: Model = getattr(import_module(module), name)
    return model


@dataclass(frozen=True, eq=False)
class Later:
    """Beside a type: this model is what it is read with."""

    make: Callable[[], Model]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return later_schema(self.make)

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        model = self.make()
        model.model_rebuild()
        schema = model.__pydantic_core_schema__
        if reference := schema.get("ref"):  # so that others can refer to it, too
            here = core_schema.definition_reference_schema(reference)
            schema = core_schema.definitions_schema(here, [schema])
        return handler(schema)


def later_schema(make: Callable[[], Model]) -> CoreSchema:
    """Return the schema of a model that is made when there is something to validate."""

    def validate(value: Any, info: ValidationInfo) -> BaseModel:
        model = make()
        if info.mode == "json":  # whose strictness is another: a list may be a tuple
            return model.model_validate_json(to_json(value), strict=True, context=info.context)
        return model.model_validate(value, context=info.context)

    return core_schema.with_info_plain_validator_function(validate)
