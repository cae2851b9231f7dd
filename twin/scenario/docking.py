"""The docks of a robot; names are opennav_docking's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field

from twin.parameters import Metres, NotNegative, Positive, Radians, Seconds
from twin.scenario.fields import PoseConfig
from twin.scenario.parameter_group import ParameterGroup
from twin.strict_yaml import StrictModel


class DockTypeParameters(ParameterGroup):
    """A kind of docks, or changes to one that ships: charger, shelf, table, tote."""

    is_charger: bool | None = None
    """Whether docking ends only when the battery is charged."""
    detection: Literal["none", "face", "box"] | None = None
    """What tells where the dock is: the map alone, a line in the scan, or that and a box there."""
    use_external_detection_pose: bool | None = None
    """Whether `detected_dock_pose` tells it instead."""
    face_width: Annotated[Metres, NotNegative] | None = None
    """Of a box whose edges tell where its middle is [m]; 0: its middle is where the map says."""
    external_detection_translation_x: Metres | None = None
    """From the face, or the detected pose, to where the base stands when docked, along x [m]."""
    external_detection_translation_y: Metres | None = None
    """The same to the left [m]."""
    external_detection_rotation_yaw: Radians | None = None
    """The same as a rotation [rad]."""
    staging_x_offset: Annotated[Metres, Field(lt=0)] | None = None
    """From the docked pose to the staging pose, along x [m]; negative: before the dock."""
    staging_yaw_offset: Radians | None = None
    """Heading at the staging pose, from that of the docked pose [rad]."""
    docking_threshold: Annotated[Metres, Positive] | None = None
    """A robot so near to the docked pose is docked [m]."""
    use_battery_status: bool | None = None
    """Whether `battery_state` tells that a charger charges, else being docked does."""
    charging_threshold: float | None = None
    """A larger current is charging [A]."""


class DockConfig(StrictModel):
    """One dock."""

    type: str
    """One that ships, or of `types`."""
    frame: str = "map"
    """Of the pose."""
    pose: PoseConfig
    """Where the base stands when docked."""


class DockingParameters(ParameterGroup):
    """Parameters of `/docking_server`."""

    types: Mapping[str, DockTypeParameters] = {}
    """Kinds of docks by name."""
    docks: Mapping[str, DockConfig] = {}
    """Docks by the name that `dock_robot` has in `dock_id`."""
    max_retries: Annotated[int, NotNegative] | None = None
    """Approaches after the first one."""
    dock_approach_timeout: Annotated[Seconds, Positive] | None = None
    """For one approach [s]."""
    dock_prestaging_tolerance: Annotated[Metres, NotNegative] | None = None
    """A robot so near to the staging pose is not driven there first [m]."""
