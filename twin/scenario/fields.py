"""Field types that several parts of a scenario share."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)

from twin.errors import nearest
from twin.geometry import Pose2, Pose3
from twin.parameters import Metres, Radians
from twin.strict_yaml import Fault, Faults, StrictModel


def _ros_name(value: str) -> str:
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", value):
        raise ValueError("must be a ROS name (letters, digits and _, a letter first)")
    return value


def _scalar_text(value: object) -> object:
    if isinstance(value, bool):
        return str(value).lower()
    return str(value) if isinstance(value, int | float) else value


def _beside_the_file(value: str, info: ValidationInfo) -> str:
    folder = (info.context or {}).get("folder")
    is_path = "/" in value or value.endswith((".yaml", ".urdf", ".xacro", ".xml"))
    return str(folder / value) if is_path and folder is not None else value


RosName = Annotated[str, AfterValidator(_ros_name)]
"""Letters, digits and underscores: it becomes part of topic and body names."""

ArgumentText = Annotated[
    str, BeforeValidator(_scalar_text), WithJsonSchema({"type": ["string", "number", "boolean"]})
]
"""A xacro argument: numbers and booleans become their text."""


def known(what: str, catalogue: Callable[[], Collection[str]]) -> AfterValidator:
    """Return the validator of a name or path: it must be one that ships with twin, or a file."""

    def check(value: str) -> str:
        names = catalogue()
        if value in names or Path(value).is_file():
            return value
        raise Faults([Fault((), f"no {what} '{value}': neither a file nor known; {nearest(value, names)}")])

    return AfterValidator(check)


def faultless(find: Callable[[Any], Iterable[Fault]]) -> Any:
    """Return the validator of a model in which nothing may be found."""

    def check(model: Any) -> Any:
        if faults := tuple(find(model)):
            raise Faults(faults)
        return model

    return model_validator(mode="after")(check)


NameOrPath = Annotated[str, AfterValidator(_beside_the_file)]
"""A name that ships with twin, or a path (it has a `/` or a suffix) relative to the file that holds it."""


FileBeside = Annotated[
    str, AfterValidator(lambda value, info: str((info.context or {}).get("folder", Path()) / value))
]
"""Path of a file, relative to the file that names it."""


class PoseConfig(StrictModel):
    """A pose on the floor, in `map`."""

    x: Metres = 0.0
    """Position along x [m]."""
    y: Metres = 0.0
    """Position along y [m]."""
    yaw: Radians = 0.0
    """Rotation about z [rad]."""

    @property
    def pose(self) -> Pose2:
        """The pose as geometry."""
        return Pose2(self.x, self.y, self.yaw)


class SpacePoseConfig(StrictModel):
    """A pose in space, in `map`."""

    x: Metres = 0.0
    """Position along x [m]."""
    y: Metres = 0.0
    """Position along y [m]."""
    z: Metres = 0.0
    """Height [m]."""
    roll: Radians = 0.0
    """Rotation about x, first [rad]."""
    pitch: Radians = 0.0
    """Rotation about y, then [rad]."""
    yaw: Radians = 0.0
    """Rotation about z, last [rad]."""

    @property
    def pose(self) -> Pose3:
        """The pose as geometry."""
        return Pose3.from_xyz_rpy((self.x, self.y, self.z), (self.roll, self.pitch, self.yaw))


class OneOf(StrictModel):
    """A mapping with exactly one of its keys; a key without a value means its defaults."""

    model_config = ConfigDict(json_schema_extra={"minProperties": 1, "maxProperties": 1})

    @model_validator(mode="before")
    @classmethod
    def _empty_means_defaults(cls, data: Any) -> Any:
        if isinstance(data, Mapping):
            return {key: {} if value is None else value for key, value in data.items()}
        return data

    @model_validator(mode="after")
    def _exactly_one(self) -> OneOf:
        if len(self.model_fields_set) != 1:
            raise ValueError(
                f"must have exactly one of the keys {', '.join(sorted(type(self).model_fields))}"
            )
        return self

    @property
    def kind(self) -> str:
        """The key that was given."""
        return next(iter(self.model_fields_set))

    @property
    def config(self) -> StrictModel:
        """The value of that key."""
        config: StrictModel = getattr(self, self.kind)
        return config
