"""What a scenario may override of a robot's path following; names are Nav2's.

The keys of every plugin stand side by side, as they do under FollowPath in a Nav2 file; one that the chosen
plugin does not have is refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, model_validator

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
from twin.scenario.parameter_group import ParameterGroup
from twin.scenario.predictive_controllers import DWBParameters, MPPIParameters
from twin.strict_yaml import Fault, Faults


def _not_the_first(name: str) -> str:
    if name == "FollowPath":
        raise ValueError("'FollowPath' is what `controller` describes; take another name")
    return name


ControllerId = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$"), AfterValidator(_not_the_first)]
"""As in Nav2's controller_plugins."""
Plugin = Literal["regulated_pure_pursuit", "dwb", "mppi"]


class PurePursuitParameters(ParameterGroup):
    """Parameters of regulated pure pursuit."""

    desired_linear_vel: Annotated[MetresPerSecond, Positive] | None = None
    """Cruise speed [m/s]."""
    lookahead_dist: Annotated[Metres, Positive] | None = None
    """Distance of the point that is followed [m]."""
    min_lookahead_dist: Annotated[Metres, Positive] | None = None
    """Its lower bound when scaled by speed [m]."""
    max_lookahead_dist: Annotated[Metres, Positive] | None = None
    """Its upper bound when scaled by speed [m]."""
    lookahead_time: Annotated[Seconds, Positive] | None = None
    """Time that the point lies ahead when scaled by speed [s]."""
    use_velocity_scaled_lookahead_dist: bool | None = None
    """Whether that distance is scaled by speed."""
    use_fixed_curvature_lookahead: bool | None = None
    """Whether curvature is taken at curvature_lookahead_dist."""
    curvature_lookahead_dist: Annotated[Metres, Positive] | None = None
    """Distance of the point for the curvature [m]."""
    interpolate_curvature_after_goal: bool | None = None
    """Whether that point may lie beyond the goal."""
    regulated_linear_scaling_min_radius: Annotated[Metres, Positive] | None = None
    """Tighter turns are driven slower [m]."""
    regulated_linear_scaling_min_speed: Annotated[MetresPerSecond, Positive] | None = None
    """But not slower than this [m/s]."""
    use_rotate_to_heading: bool | None = None
    """Whether the robot turns in place to a path behind it, and at the goal."""
    rotate_to_heading_min_angle: Annotated[Radians, Positive] | None = None
    """Off the path's direction by more than this [rad]."""
    approach_velocity_scaling_dist: Annotated[Metres, Positive] | None = None
    """Nearer to the goal the robot slows down [m]."""
    min_approach_linear_velocity: Annotated[MetresPerSecond, Positive] | None = None
    """But not below this [m/s]."""
    max_allowed_time_to_collision_up_to_carrot: Annotated[Seconds, Positive] | None = None
    """How far ahead a command is checked for collisions [s]."""
    turn_before_collision: bool | None = None
    """Whether, where the arc ahead is blocked, the robot turns in place or creeps before following fails."""
    max_linear_decel: Annotated[float, NotNegative] | None = None
    """With which the robot brakes: the way to a stop is kept free; 0: not [m/s²]."""
    use_collision_detection: bool | None = None
    """Whether commands are checked for collisions."""
    cost_scaling_dist: Annotated[Metres, Positive] | None = None
    """Closer to an obstacle the robot slows down [m]."""
    cost_scaling_gain: Annotated[float, Positive] | None = None
    """Above 1: less."""
    allow_reversing: bool | None = None
    """Whether paths are driven backwards where their headings say so."""
    use_cancel_deceleration: bool | None = None
    """Whether a cancelled robot follows its path until it stands."""
    cancel_deceleration: Annotated[float, Positive] | None = None
    """Its deceleration then [m/s²]."""


class RotationParameters(ParameterGroup):
    """Parameters of turning in place: of regulated pure pursuit, and of the rotation shim."""

    rotate_to_heading_angular_vel: Annotated[RadiansPerSecond, Positive] | None = None
    """Turn rate on the spot [rad/s]."""
    max_angular_accel: Annotated[float, Positive] | None = None
    """Its acceleration [rad/s²]."""


class ShimParameters(ParameterGroup):
    """Parameters of the rotation shim."""

    angular_dist_threshold: Annotated[Radians, Positive] | None = None
    """Farther off the path's direction the robot turns in place [rad]."""
    angular_disengage_threshold: Annotated[Radians, Positive] | None = None
    """Until it is nearer to it than this [rad]."""
    forward_sampling_distance: Annotated[Metres, Positive] | None = None
    """Where along the path its direction is taken [m]."""
    simulate_ahead_time: Annotated[Seconds, Positive] | None = None
    """How much of a turn is checked for collisions [s]."""
    rotate_to_goal_heading: bool | None = None
    """Whether the robot turns in place at the goal, too."""
    rotate_to_heading_once: bool | None = None
    """Whether a path to the same goal as the last one is not turned to."""


class ServerParameters(ParameterGroup):
    """Parameters of the server, and of its goal and progress checkers."""

    plugin: Plugin | None = None
    """What follows the path; absent: `regulated_pure_pursuit`."""
    rotation_shim: bool | None = None
    """Whether the robot turns in place to a path's direction, and at the goal; absent: with all but regulated
    pure pursuit, which does that itself."""
    controller_frequency: Annotated[Hertz, Positive] | None = None
    """Rate of the velocity commands [Hz]."""
    failure_tolerance: Annotated[Seconds, NotNegative] | None = None
    """How long the robot waits for a way to open before following fails [s]."""
    maneuvers: bool | None = None
    """Whether a robot that has stood blocked for 1.5 s, if `failure_tolerance` is longer, looks for moves to
    and fro that free it; absent: yes. Otherwise that is left to recoveries."""
    goal_checker: Literal["simple", "stopped", "position"] | None = None
    """What a goal asks for: position and heading, rest too, or position alone; absent: `simple`."""
    xy_goal_tolerance: Annotated[Metres, Positive] | None = None
    """Position tolerance of the goal checker [m]."""
    yaw_goal_tolerance: Annotated[Radians, Positive] | None = None
    """Heading tolerance of the goal checker [rad]."""
    progress_checker: Literal["simple", "pose"] | None = None
    """What progress is: a movement, or a turn too; absent: `simple`."""
    required_movement_radius: Annotated[Metres, Positive] | None = None
    """Progress checker: movement that counts [m]."""
    required_movement_angle: Annotated[Radians, Positive] | None = None
    """Progress checker `pose`: turn that counts [rad]."""
    movement_time_allowance: Annotated[Seconds, Positive] | None = None
    """Progress checker: time allowed for it [s]."""


_OF_PLUGIN: dict[str, tuple[type[ParameterGroup], ...]] = {
    "regulated_pure_pursuit": (PurePursuitParameters, RotationParameters),
    "dwb": (DWBParameters,),
    "mppi": (MPPIParameters,),
}


_OF_EACH_CONTROLLER = {"plugin", "rotation_shim", "goal_checker", "xy_goal_tolerance", "yaw_goal_tolerance"}
"""The server's keys that every controller has for itself."""


def _valid_with(name: str) -> str:
    """Return what a key needs beside it."""
    owners = [f"`plugin: {plugin}`" for plugin, groups in _OF_PLUGIN.items() if _has(groups, name)]
    if _has((ShimParameters, RotationParameters), name):
        owners.append("`rotation_shim: true`")
    return " or ".join(owners)


def _has(groups: Iterable[type[ParameterGroup]], name: str) -> bool:
    return any(name in group.model_fields for group in groups)


class ControllerParameters(
    ServerParameters,
    PurePursuitParameters,
    RotationParameters,
    ShimParameters,
    DWBParameters,
    MPPIParameters,
):
    """Parameters of `/controller_server`, of its checkers, and of the plugin that follows paths."""

    @property
    def chosen(self) -> Plugin:
        """The plugin, given or not."""
        return self.plugin or "regulated_pure_pursuit"

    @property
    def shim(self) -> bool:
        """Whether the rotation shim is in front of it."""
        return self.chosen != "regulated_pure_pursuit" if self.rotation_shim is None else self.rotation_shim

    @model_validator(mode="after")
    def _keys_of_the_plugin(self) -> ControllerParameters:
        faults = list(self._foreign())
        if faults:
            raise Faults(faults)
        return self

    def _foreign(self) -> Iterator[Fault]:
        groups: list[type[ParameterGroup]] = [ServerParameters, *_OF_PLUGIN[self.chosen]]
        if self.shim:
            groups += [ShimParameters, RotationParameters]
        valid = {name for group in groups for name in group.model_fields}
        for name in type(self).model_fields:
            if name in self.model_fields_set and name not in valid:
                told = f"{self.chosen} {'with' if self.shim else 'without'} rotation shim"
                yield Fault((name,), f"'{name}' is not of {told}; valid with {_valid_with(name)}")

        if "required_movement_angle" in self.model_fields_set and self.progress_checker != "pose":
            yield Fault(
                ("required_movement_angle",),
                "'required_movement_angle' needs 'progress_checker: pose' beside it",
            )
        if "yaw_goal_tolerance" in self.model_fields_set and self.goal_checker == "position":
            yield Fault(
                ("yaw_goal_tolerance",), "'yaw_goal_tolerance' is not looked at with 'goal_checker: position'"
            )

    def overrides(self) -> dict[str, Any]:
        """Return only the parameters that the file gives, by name; a critic's as a mapping."""
        found = super().overrides()
        return {
            name: value.overrides() if isinstance(value, ParameterGroup) else value
            for name, value in found.items()
        }


class FurtherControllerParameters(ControllerParameters):
    """Parameters of a controller beside FollowPath, and of a goal checker of the same name."""

    @model_validator(mode="after")
    def _keys_of_no_server(self) -> FurtherControllerParameters:
        server = set(ServerParameters.model_fields) - _OF_EACH_CONTROLLER
        faults = [
            Fault((name,), f"'{name}' holds for all controllers: give it under `controller`")
            for name in sorted(server & self.model_fields_set)
        ]
        if faults:
            raise Faults(faults)
        return self
