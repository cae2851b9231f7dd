"""Who estimates a robot's pose, and what a scenario may override of it; names are Nav2's."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, model_validator

from twin.parameters import Metres, NotNegative, Radians
from twin.scenario.fields import FileBeside, NameOrPath, PoseConfig
from twin.strict_yaml import StrictModel
from twin.strict_yaml.later import found, later

_AMCL, _EKF, _SLAM = (
    f"twin.scenario.estimators.{name.lower()}:{name}Parameters" for name in ("Amcl", "Ekf", "Slam")
)
if TYPE_CHECKING:
    from twin.scenario.estimators.amcl import AmclParameters
    from twin.scenario.estimators.ekf import EkfParameters
    from twin.scenario.estimators.slam import SlamParameters
else:
    AmclParameters, EkfParameters, SlamParameters = map(later, (_AMCL, _EKF, _SLAM))


def _untouched(group: str) -> Any:
    """Return the default of a group: no parameter is given."""
    return Field(default_factory=lambda: found(group).model_construct())


class InitialPoseError(StrictModel):
    """How wrong the first guess of the pose is."""

    xy: Annotated[Metres, NotNegative] = 0.0
    """Distance from the true start, in a direction drawn from the seed [m]."""
    yaw: Annotated[Radians, NotNegative] = 0.0
    """Size of the heading error, its sign drawn from the seed [rad]."""


class WheelOdometry(StrictModel):
    """The wheels alone: `/diff_drive_controller` publishes odom → base."""

    type: Literal["wheels"]
    """`wheels`"""


class EkfOdometry(StrictModel):
    """Wheels and IMU, fused by `/ekf_filter_node`, which publishes odom → base."""

    type: Literal["ekf"]
    """`ekf`"""
    params_file: FileBeside | None = None
    """A parameter file of robot_localization; absent: that of `navigation`, if it has a filter."""
    parameters: EkfParameters = _untouched(_EKF)
    """Overrides of the filter's parameters, and of the file's."""


Odometry = Annotated[WheelOdometry | EkfOdometry, Field(discriminator="type")]


class NoLocalisation(StrictModel):
    """Nobody estimates the pose."""

    type: Literal["none"]
    """`none`"""


class OdometryLocalisation(StrictModel):
    """Dead reckoning from the start pose: `map` and `odom` are tied together."""

    type: Literal["odometry"]
    """`odometry`"""
    use_imu: bool = False
    """Whether odometry takes its heading from the robot's gyroscope instead of from its wheels."""
    initial_pose_error: InitialPoseError = InitialPoseError.model_construct()
    """How wrong the first guess is."""


class AmclLocalisation(StrictModel):
    """Monte Carlo localisation on a map (`/amcl`)."""

    type: Literal["amcl"]
    """`amcl`"""
    map: NameOrPath | None = None
    """Name of a shipped map, or path of a map_server YAML file; absent: the arena's own map."""
    initial_pose: Literal["start", "global"] = "start"
    """`start`: a guess is given, the start within `initial_pose_error`; `global`: the robot has no idea and
    looks for itself on the whole map (nav2_amcl's `set_initial_pose: false`)."""
    initial_pose_error: InitialPoseError = InitialPoseError.model_construct()
    """How wrong the first guess is."""
    parameters: AmclParameters = _untouched(_AMCL)
    """Overrides of the filter's parameters."""


class SlamLocalisation(StrictModel):
    """Mapping an unknown place, or localisation in a pose graph made before (`/slam_toolbox`)."""

    type: Literal["slam"]
    """`slam`"""
    params_file: FileBeside | None = None
    """A parameter file of slam_toolbox; absent: that of `navigation`, if it has such a node."""
    mode: Literal["mapping", "localization"] = "mapping"
    """`mapping` makes a map, or goes on with that of `pose_graph`; `localization` leaves it as it is."""
    pose_graph: FileBeside | None = None
    """A pose graph that `serialize_map` or an earlier run has written; absent: nothing is known."""
    map_start_pose: PoseConfig | None = None
    """The robot's pose in `map` at the start; absent: that in the world, so that both frames are one."""
    initial_pose_error: InitialPoseError = InitialPoseError.model_construct()
    """How wrong that is."""
    parameters: SlamParameters = _untouched(_SLAM)
    """Overrides of the node's parameters, and of the file's."""

    @model_validator(mode="after")
    def _has_a_graph(self) -> SlamLocalisation:
        if self.mode == "localization" and self.pose_graph is None and self.params_file is None:
            raise ValueError("localization needs a pose_graph; without one only mapping is possible")
        return self


Localisation = Annotated[
    NoLocalisation | OdometryLocalisation | AmclLocalisation | SlamLocalisation, Field(discriminator="type")
]
