"""What goes wrong during a run: `FAULTS` are all kinds, `FaultEntry` is one item of a scenario's list."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema

from twin.parameters import Metres, NotNegative, Positive, Seconds
from twin.plugins import Kind
from twin.scenario.fields import OneOf, RosName
from twin.scenario.plugins import OneOfKind, PluginUse, with_shipped
from twin.strict_yaml import StrictModel

Outcome = Literal["landed", "no_effect", "not_reached"]
"""It happened and something came of it; it happened, and nothing did; it never happened."""


class Near(StrictModel):
    """A circle on the floor."""

    x: Metres
    """Of its middle, in the world [m]."""
    y: Metres
    """Of its middle, in the world [m]."""
    within: Annotated[Metres, Positive]
    """Its radius [m]."""


class When(OneOf):
    """What a fault waits for: exactly one of these keys."""

    near: Near | None = None
    """The robot's base comes into a circle."""
    zone: str | None = None
    """The robot's base comes into a zone of the arena."""
    mission_state: str | None = None
    """A state of the mission begins; `*` and `?` stand for any letters."""
    grasped: str | None = None
    """The robot holds a good; `*` and `?` stand for any letters."""
    driven: Annotated[Metres, Positive] | None = None
    """The robot's base has come so far, along its way [m]."""
    fault: str | None = None
    """Another fault begins: its `label`, or its kind."""


@dataclass(frozen=True, kw_only=True)
class FaultConfig:
    """What all faults have in common."""

    label: RosName | None = None
    """What triggers and reports call it, and its noise depends on; absent: its kind."""
    at: Annotated[Seconds, NotNegative] | None = None
    """When it begins [s]; without `at` and `when`: with the run."""
    when: When | None = None
    """What it begins with, instead of `at`."""
    after: Annotated[Seconds, NotNegative] = 0.0
    """So long after `when` [s]."""


@dataclass(frozen=True, kw_only=True)
class LastingFault(FaultConfig):
    """A fault that ends."""

    duration: Annotated[Seconds, Positive] | None = None
    """How long it lasts [s]; absent: until the end."""


@dataclass(frozen=True, kw_only=True)
class RobotFault(FaultConfig):
    """A fault of one robot."""

    robot: str | None = None
    """Name of the robot; may be left out if there is only one."""


@dataclass(frozen=True, kw_only=True)
class LastingRobotFault(RobotFault, LastingFault):
    """A fault of one robot that ends."""


FAULTS: Kind[Any] = Kind("fault", base="twin.faults:Fault", group="twin.faults")

FAULTS.register("noise", "twin.faults.readings:Noise")
FAULTS.register("bias", "twin.faults.readings:Bias")
FAULTS.register("dropout", "twin.faults.outages:Dropout")
FAULTS.register("freeze", "twin.faults.outages:Freeze")
FAULTS.register("delay", "twin.faults.outages:Delay")
FAULTS.register("lidar", "twin.faults.outages:LidarFailure")
FAULTS.register("encoder", "twin.faults.wheels:Encoder")
FAULTS.register("odometry_jump", "twin.faults.wheels:OdometryJump")
FAULTS.register("wheel_radius", "twin.faults.wheels:WheelRadius")
FAULTS.register("track", "twin.faults.wheels:Track")
FAULTS.register("wheel_slip", "twin.faults.friction:WheelSlip")
FAULTS.register("friction", "twin.faults.friction:Friction")
FAULTS.register("slippery_floor", "twin.faults.friction:SlipperyFloor")
FAULTS.register("stuck_caster", "twin.faults.friction:StuckCaster")
FAULTS.register("weak_motor", "twin.faults.motors:WeakMotor")
FAULTS.register("flat_battery", "twin.faults.motors:FlatBattery")
FAULTS.register("latency", "twin.faults.motors:Latency")
FAULTS.register("mass", "twin.faults.bodies:Mass")
FAULTS.register("dropped_good", "twin.faults.motors:DroppedGood")
FAULTS.register("loss", "twin.faults.messages:Loss")
FAULTS.register("link_delay", "twin.faults.messages:LinkDelay")
FAULTS.register("duplication", "twin.faults.messages:Duplication")
FAULTS.register("kidnapping", "twin.faults.bodies:Kidnapping")
FAULTS.register("displacement", "twin.faults.bodies:Displacement")
FAULTS.register("person", "twin.faults.obstacles:Person")
FAULTS.register("pallet", "twin.faults.obstacles:Pallet")


@with_shipped
class FaultEntry(OneOfKind):
    """One fault: exactly one of these keys, or the name of a fault of a user; some are one number as well."""

    of = FAULTS

    @model_validator(mode="before")
    @classmethod
    def _one_number(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        return {key: _whole(key, value) for key, value in data.items()}

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        reference = super().__get_pydantic_json_schema__(core, handler)
        properties = handler.resolve_ref_schema(reference)["properties"]
        for name in FAULTS.shipped:
            if value := FAULTS.find(name).load().value:
                choices = properties[name]["anyOf"]
                number = handler.resolve_ref_schema(choices[0])["properties"][value]
                choices += number.get("anyOf", [{key: number[key] for key in number if key != "description"}])
        return reference

    @property
    def given(self) -> Mapping[str, Any]:
        """Its keys with their values; those that are not given only if it ships."""
        return self.config.params if isinstance(self.config, PluginUse) else vars(self.config)

    @property
    def needs_robot(self) -> bool:
        """Whether it is of one robot, which must be named if there are several."""
        return self.kind in FAULTS.shipped and FAULTS.find(self.kind).load().is_of_robot

    @property
    def title(self) -> str:
        """Its label, or its kind without a user's file."""
        return self.given.get("label") or self.kind.rpartition(":")[2]


def titles(entries: Sequence[FaultEntry]) -> list[str]:
    """Return what faults are called, each otherwise: of several without a label the second ends with `_2`."""
    return _numbered([(entry.title,) for entry in entries])


def streams(entries: Sequence[FaultEntry]) -> dict[str, str]:
    """Return what the random numbers of faults depend on, by title: others have no influence on it.

    It is a fault's label or kind, and a number only if there are several alike of the same sensor or topic.
    """
    keys = ("robot", "sensor", "topic")
    alike = [(entry.title, *(entry.given.get(key) for key in keys)) for entry in entries]
    return dict(zip(titles(entries), _numbered(alike), strict=True))


def _numbered(alike: Sequence[tuple[Any, ...]]) -> list[str]:
    """Return the first item of each, with a number for those of which there was an equal one before."""
    counts = [alike[:i].count(one) for i, one in enumerate(alike)]
    return [str(one[0]) + (f"_{n + 1}" if n else "") for one, n in zip(alike, counts, strict=True)]


def _whole(kind: str, value: Any) -> Any:
    """Return the keys that a single number stands for."""
    if isinstance(value, Mapping) or value is None or kind not in FAULTS.shipped:
        return value
    key = FAULTS.find(kind).load().value
    return {key: value} if key else value


@dataclass(frozen=True, kw_only=True)
class FaultReport:
    """What became of a fault in a run."""

    name: str
    """Its label, or its kind."""
    kind: str
    outcome: Outcome
    at_s: float | None = None
    """When it began [s]; None if it did not."""
    end_s: float | None = None
    """When it ended [s]; None if it did not."""
    effect: str = ""
    """What came of it, measured where it acts: `12 of 80 messages lost`."""
