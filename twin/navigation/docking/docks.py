"""Which docks there are and of what kinds (opennav_docking's DockDatabase and SimpleChargingDock)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Annotated, Literal

from twin.errors import nearest
from twin.geometry import Pose2, Pose3
from twin.parameters import Amperes, Flat, Interval, Le, Metres, NotNegative, Positive, Radians, Seconds

Detection = Literal["none", "face", "box"]
Offset = Annotated[Metres, Interval(ge=-10.0, le=10.0)]
Turn = Annotated[Radians, Interval(ge=-math.tau, le=math.tau)]
DOCK_NOT_IN_DB, DOCK_NOT_VALID = 901, 902


@dataclass(frozen=True, kw_only=True)
class DockType:
    """Docks of one kind; names are SimpleChargingDock's, and so are defaults unless said otherwise."""

    is_charger: bool = False
    """Whether docking ends only when the battery is charged."""
    detection: Detection = "face"
    """What tells where the dock is: none (the map), face (a line in the scan), box (that and a box there)."""
    use_external_detection_pose: bool = False
    """Whether `detected_dock_pose` tells instead."""
    face_width: Annotated[Metres, NotNegative, Le(100.0)] = 0.0
    """Of a box whose edges tell where its middle is; 0: its middle is where the map says."""
    external_detection_timeout: Annotated[Seconds, Positive] = 1.0
    """A pose on `detected_dock_pose` older than this is none."""
    external_detection_translation_x: Offset = -0.55
    """From the face, or the detected pose, to where the base stands when docked, along x into the dock; Nav2:
    -0.2."""
    external_detection_translation_y: Offset = 0.0
    """The same to the left."""
    external_detection_rotation_yaw: Turn = 0.0
    """The same as a rotation."""
    external_detection_rotation_pitch: Turn = math.pi / 2.0
    """Of the detected pose, too: its z comes out of the dock, as that of a tag ..."""
    external_detection_rotation_roll: Turn = -math.pi / 2.0
    """... and y up; both 0 for a pose whose x points into the dock."""
    filter_coef: Annotated[float, Interval(gt=0.0, le=1.0)] = 0.1
    """Weight of each new pose on `detected_dock_pose` against those before."""
    staging_x_offset: Annotated[Metres, Interval(ge=-10.0, lt=0.0)] = -0.75
    """From the docked pose to the staging pose, along x; negative: before the dock. Nav2: -0.7."""
    staging_yaw_offset: Turn = 0.0
    """Heading at the staging pose, from that of the docked pose."""
    docking_threshold: Annotated[Metres, Positive, Le(10.0)] = 0.05
    """A robot so near to the docked pose is docked."""
    use_battery_status: bool = False
    """Whether `battery_state` tells that a charger charges, else being docked does; Nav2: true."""
    charging_threshold: Annotated[Amperes, NotNegative] = 0.5
    """A larger current is charging."""

    def detected(self, pose: Pose3) -> Pose2:
        """Return a pose of `detected_dock_pose` on the floor, x into the dock, but for the yaw offset."""
        turned = (self.external_detection_rotation_roll, self.external_detection_rotation_pitch, 0.0)
        return (pose @ Pose3.from_xyz_rpy(rpy=turned)).to_pose2()

    @property
    def T_detected_docked(self) -> Pose2:
        """Pose of the docked base in the detected frame, whose x axis points into the dock."""
        aside = Pose2(self.external_detection_translation_x, self.external_detection_translation_y, 0.0)
        return Pose2(0.0, 0.0, self.external_detection_rotation_yaw) @ aside

    def staging_pose(self, docked: Pose2) -> Pose2:
        """Return where to begin, for a docked pose in any frame."""
        return docked @ Pose2(self.staging_x_offset, 0.0, self.staging_yaw_offset)


@dataclass(frozen=True, kw_only=True)
class Dock:
    """One dock."""

    type: str = ""
    """Name of its type; may be empty if there is only one."""
    frame: str = "map"
    """Of the pose."""
    pose: Pose2
    """Where the base stands when docked, in `frame`."""


class DockError(Exception):
    """A dock that cannot be used; `code` is that of the action's result."""

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(reason)
        self.code = code


_TYPES: Mapping[str, DockType] = MappingProxyType({"charger": DockType(is_charger=True, face_width=0.6)})


@dataclass(frozen=True, kw_only=True)
class DockDatabase:
    """All docks by their ids, and their types by name."""

    types: Annotated[Mapping[str, DockType], Flat] = field(default_factory=lambda: dict(_TYPES))
    """Kinds of docks by name."""
    docks: Annotated[Mapping[str, Dock], Flat] = field(default_factory=dict)
    """Docks by the name that `dock_robot` has in `dock_id`."""

    def find(self, dock_id: str) -> Dock:
        """Return a dock; raises DockError if there is none of this name."""
        if dock_id not in self.docks:
            valid = nearest(dock_id, self.docks) if self.docks else "the database is empty"
            raise DockError(DOCK_NOT_IN_DB, f"there is no dock '{dock_id}'; {valid}")
        return self.docks[dock_id]

    def type_of(self, name: str) -> DockType:
        """Return a type of docks; if there is only one, '' is that one.

        Raises:
            DockError: there is none of this name.
        """
        if not name and len(self.types) == 1:
            return next(iter(self.types.values()))
        if name not in self.types:
            raise DockError(DOCK_NOT_VALID, f"there is no dock type '{name}'; valid: {', '.join(self.types)}")
        return self.types[name]
