"""Who estimates a robot's pose, and what a scenario may override of it; names are Nav2's."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from twin.navigation.localisation.amcl_config import AmclConfig
from twin.navigation.localisation.ekf import EkfConfig
from twin.nodes.navigation.localisation.ekf_config import SOURCE, EkfNodeConfig, EkfSource
from twin.nodes.navigation.mapping.config import SlamNodeConfig
from twin.parameters import Metres, NotNegative, Radians
from twin.parameters.placed import overridden
from twin.scenario.fields import FileBeside, NameOrPath, PoseConfig
from twin.scenario.parameter_group import ParameterGroup, keys_of
from twin.strict_yaml import StrictModel


class _Checked(ParameterGroup):
    """Parameters that must fit together, and to the defaults of a config."""

    among: ClassVar[type]

    @model_validator(mode="after")
    def _can_be(self) -> Self:
        overridden(self.among(), self.overrides())
        return self


@keys_of(AmclConfig)
class AmclParameters(_Checked):
    """Parameters of `/amcl`."""

    among = AmclConfig


@keys_of(SlamNodeConfig)
class SlamParameters(_Checked):
    """Parameters of `/slam_toolbox`."""

    among = SlamNodeConfig


@keys_of(EkfSource)
class EkfSourceParameters(ParameterGroup):
    """A source of `/ekf_filter_node`; of its keys those count that robot_localization has for its kind."""


def _source_name(name: str) -> str:
    if not re.fullmatch(SOURCE, name):
        raise ValueError("a source is called odom0, pose0, twist0, imu0, odom1...")
    return name


SourceName = Annotated[str, AfterValidator(_source_name)]


@keys_of(EkfNodeConfig)
class EkfParameters(_Checked):
    """Parameters of `/ekf_filter_node`."""

    among = EkfConfig
    sources: Mapping[SourceName, EkfSourceParameters] = {}
    """What it listens to besides, or instead of, `odom0` (wheels) and `imu0`."""


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
    parameters: EkfParameters = EkfParameters.model_construct()
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
    parameters: AmclParameters = AmclParameters.model_construct()
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
    parameters: SlamParameters = SlamParameters.model_construct()
    """Overrides of the node's parameters, and of the file's."""

    @model_validator(mode="after")
    def _has_a_graph(self) -> SlamLocalisation:
        if self.mode == "localization" and self.pose_graph is None and self.params_file is None:
            raise ValueError("localization needs a pose_graph; without one only mapping is possible")
        return self


Localisation = Annotated[
    NoLocalisation | OdometryLocalisation | AmclLocalisation | SlamLocalisation, Field(discriminator="type")
]
