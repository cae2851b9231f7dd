"""What the robots of a scenario are to do."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

from pydantic import (
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    TypeAdapter,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    model_validator,
)
from pydantic_core import CoreSchema, core_schema

from twin.nodes.missions.random_goals_config import RandomGoalsConfig
from twin.nodes.navigation.exploration.config import ExplorerNodeConfig
from twin.parameters import (
    Hertz,
    Metres,
    MetresPerSecond,
    NotNegative,
    Positive,
    Radians,
    RadiansPerSecond,
    Seconds,
)
from twin.plugins import Kind
from twin.scenario.fields import OneOf
from twin.scenario.parameter_group import ParameterGroup, keys_of
from twin.scenario.plugins import PluginUse, use
from twin.strict_yaml import StrictModel
from twin.strict_yaml.later import later_schema

if TYPE_CHECKING:
    from twin.nodes.missions.mission_node import MissionNode


class PickAndPlaceTask(StrictModel):
    """Carry one tote to one zone."""

    tote: str
    """Name of the tote in the arena."""
    to: str
    """Name of the arena's zone to put it down in, in the mission tasks also a slot of its table."""


class PickAndPlace(StrictModel):
    """Drive to the totes, grasp them, carry them to their zones, one after the other."""

    type: Literal["pick_and_place"]
    """`pick_and_place`"""
    robot: str
    """Name of the robot."""
    tasks: Annotated[tuple[PickAndPlaceTask, ...], Field(min_length=1)]
    """The totes to move, in this order."""


class DriveOnHeading(StrictModel):
    """Drive straight ahead (Nav2 `drive_on_heading`)."""

    distance: Annotated[Metres, Positive]
    """Distance along x of the robot [m]."""
    speed: Annotated[MetresPerSecond, Positive] = 0.2
    """Speed [m/s]."""


class BackUp(StrictModel):
    """Drive straight back (Nav2 `backup`)."""

    distance: Annotated[Metres, Positive]
    """Distance against x of the robot [m]."""
    speed: Annotated[MetresPerSecond, Positive] = 0.1
    """Speed [m/s]."""


class Spin(StrictModel):
    """Turn on the spot (Nav2 `spin`)."""

    angle: Radians
    """Angle to turn, counter-clockwise positive [rad]."""


class Wait(StrictModel):
    """Stand still (Nav2 `wait`)."""

    duration: Annotated[Seconds, Positive]
    """Time to stand [s]."""


class NavigateToPose(StrictModel):
    """Drive to a pose in `map` (Nav2 `navigate_to_pose`)."""

    x: Metres
    """Goal along x [m]."""
    y: Metres
    """Goal along y [m]."""
    yaw: Radians = 0.0
    """Goal heading [rad]."""


class DockRobot(StrictModel):
    """Drive to a dock of `robots[].navigation.docking.docks` and dock (Nav2 `dock_robot`)."""

    dock: str
    """Its name."""
    max_staging_time: Annotated[Seconds, Positive] = 1000.0
    """For the way to the pose before it [s]."""


class UndockRobot(StrictModel):
    """Drive straight back from the dock (Nav2 `undock_robot`)."""

    dock_type: str = ""
    """Type of the dock; absent: that of the dock at which the robot docked."""


class BehaviorStep(OneOf):
    """One step: exactly one of these keys."""

    drive_on_heading: DriveOnHeading | None = None
    """Straight ahead."""
    backup: BackUp | None = None
    """Straight back."""
    spin: Spin | None = None
    """Turn on the spot."""
    wait: Wait | None = None
    """Stand still."""
    navigate_to_pose: NavigateToPose | None = None
    """Drive to a pose."""
    dock_robot: DockRobot | None = None
    """Drive to a dock and dock."""
    undock_robot: UndockRobot | None = None
    """Leave the dock."""


class Behaviors(StrictModel):
    """Run Nav2 behaviours one after the other."""

    type: Literal["behaviors"]
    """`behaviors`"""
    robot: str
    """Name of the robot."""
    steps: Annotated[tuple[BehaviorStep, ...], Field(min_length=1)]
    """The behaviours, in this order."""
    repeat: Annotated[int, Positive] = 1
    """How often to run all steps."""


class DriveTo(StrictModel):
    """Drive to a named place, or to a pose in `map`."""

    place: str = ""
    """One of the arena's poses or zones; absent: x and y."""
    x: Metres | None = None
    """Goal along x [m]."""
    y: Metres | None = None
    """Goal along y [m]."""
    yaw: Radians = 0.0
    """Goal heading [rad]."""

    @model_validator(mode="after")
    def _is_somewhere(self) -> DriveTo:
        given = self.model_fields_set
        if bool(self.place) == bool(given & {"x", "y", "yaw"}) or (
            not self.place and not {"x", "y"} <= given
        ):
            raise ValueError("must have either a place, or x and y")
        return self


class DockAt(StrictModel):
    """Drive to a dock of `robots[].navigation.docking.docks` and dock."""

    dock: str
    """Its name."""


class Undock(StrictModel):
    """Leave the dock."""


class QueuedTask(OneOf):
    """One task: exactly one of these keys."""

    drive_to: DriveTo | None = None
    """Drive to a place."""
    carry: PickAndPlaceTask | None = None
    """Carry a tote."""
    dock: DockAt | None = None
    """Drive to a dock and dock."""
    undock: Undock | None = None
    """Leave the dock."""
    wait: Wait | None = None
    """Stand still."""


class Tasks(StrictModel):
    """Do tasks one after the other: those listed, and those that others add while the run goes on."""

    type: Literal["tasks"]
    """`tasks`"""
    robot: str
    """Name of the robot."""
    tasks: tuple[QueuedTask, ...] = ()
    """With which it begins, in this order."""
    waits_for_more: bool = True
    """Whether it goes on when nothing is left to do; else it is done then, and has failed with the first
    task that fails."""


@keys_of(RandomGoalsConfig, whole=True)
class RandomGoals(ParameterGroup):
    """Drive to random places of `/map`, one after the other: a soak test of navigation."""

    type: Literal["random_goals"]
    """`random_goals`"""
    robot: str
    """Name of the robot."""


class VelocityStep(StrictModel):
    """A velocity command held for some time."""

    duration: Annotated[Seconds, Positive]
    """How long to send it [s]."""
    linear: MetresPerSecond = 0.0
    """Forward speed [m/s]."""
    angular: RadiansPerSecond = 0.0
    """Turn rate, counter-clockwise positive [rad/s]."""


class VelocityProfile(StrictModel):
    """Send velocity commands open loop on `cmd_vel`, then stop."""

    type: Literal["velocity_profile"]
    """`velocity_profile`"""
    robot: str
    """Name of the robot."""
    steps: Annotated[tuple[VelocityStep, ...], Field(min_length=1)]
    """The commands, in this order."""
    repeat: Annotated[int, Positive] = 1
    """How often to run all steps."""


class R2D2StatePublisher(StrictModel):
    """Move R2-D2 on a circle in `odom` while its joints sweep, as the URDF tutorial does."""

    type: Literal["r2d2_state_publisher"]
    """`r2d2_state_publisher`"""
    robot: str
    """Name of the robot."""
    radius: Annotated[Metres, NotNegative] = 2.0
    """Radius of the circle about the origin of `odom` [m]."""
    rate: Annotated[Hertz, Positive] = 30.0
    """Cycles per second [Hz], at most one per control period."""
    degrees_per_cycle: Annotated[float, Positive] = 0.25
    """Progress on the circle per cycle [deg]."""


@keys_of(ExplorerNodeConfig)
class Explore(ParameterGroup):
    """Drive to the borders of what is known until nothing reachable is unknown (explore_lite)."""

    type: Literal["explore"]
    """`explore`"""
    robot: str
    """Name of the robot; its localisation is of type slam."""


class Idle(StrictModel):
    """Nobody does anything; the run lasts its whole duration."""

    type: Literal["idle"]
    """`idle`"""


MISSIONS: Kind[MissionNode] = Kind(
    "mission", base="twin.nodes.missions.mission_node:MissionNode", group="twin.missions"
)


class UserMission(StrictModel):
    """A mission of your own; its other keys are its parameters."""

    model_config = ConfigDict(extra="allow")
    type: str
    """`FILE.py:Class`, `module:Class`, or the name of an installed package's mission."""
    robot: str | None = None
    """Name of the robot; may be left out if there is only one."""

    @property
    def use(self) -> PluginUse:
        """The plugin and its parameters."""
        return PluginUse(reference=self.type, params=self.model_extra or {})


def _schema_of(model: type[StrictModel]) -> CoreSchema:
    return later_schema(lambda: model)


class _OrAUsers:
    """Metadata of `Mission`: a type that does not ship is a plugin's."""

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        each = {name: _schema_of(model) for name, model in _BY_NAME.items()}
        shipped = core_schema.tagged_union_schema(each, "type")
        return core_schema.with_info_wrap_validator_function(self._validate, shipped)

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        ships: TypeAdapter[Any] = TypeAdapter(Annotated[_Ships, Field(discriminator="type")])
        return {"anyOf": [handler(ships.core_schema), UserMission.model_json_schema()]}

    def _validate(self, data: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        if isinstance(data, StrictModel):
            return data
        named = data.get("type") if isinstance(data, Mapping) else None
        name = named if isinstance(named, str) else ""
        if name in MISSIONS.shipped or not (":" in name or name in MISSIONS.names()):
            return handler(data)
        params = {key: value for key, value in data.items() if key not in ("type", "robot")}
        used = use(MISSIONS, name, params, info, named_at=("type",))
        return UserMission.model_validate({**data, "type": used.reference}, strict=True)


_Tasks = PickAndPlace | Behaviors | RandomGoals | VelocityProfile | R2D2StatePublisher | Explore | Tasks
_Ships = _Tasks | Idle
_BY_NAME = {get_args(one.model_fields["type"].annotation)[0]: one for one in get_args(_Ships)}
for _name in _BY_NAME:
    MISSIONS.register(_name, f"twin.runtime.stacks.missions:{_name}")


Mission = Annotated[_Ships | UserMission, _OrAUsers()]
Task = _Tasks | UserMission
"""What a robot does."""
