"""Models that are imported, and made, only if a file has what they describe."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Annotated, Any

from pydantic import BaseModel, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, core_schema, to_json


def later(target: str) -> Any:
    """Return the type of a key whose model is `module:Class`."""
    return Annotated[Any, _Later(target)]


@dataclass(frozen=True)
class _Later:
    target: str

    @property
    def model(self) -> type[BaseModel]:
        module, _, name = self.target.partition(":")
        found: type[BaseModel] = getattr(import_module(module), name)
        found.model_rebuild()
        return found

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self._validate)

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return handler(self.model.__pydantic_core_schema__)

    def _validate(self, value: Any, info: ValidationInfo) -> BaseModel:
        validator = self.model.__pydantic_validator__
        if info.mode == "json":  # whose strictness is another: a list may be a tuple
            made: BaseModel = validator.validate_json(to_json(value), strict=True, context=info.context)
        else:
            made = validator.validate_python(value, context=info.context)
        return made
