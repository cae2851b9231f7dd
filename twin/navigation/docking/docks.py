"""Which docks there are and of what kinds (opennav_docking's DockDatabase and SimpleChargingDock)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from twin.errors import nearest
from twin.geometry import Pose2

DETECTIONS = ("none", "face", "box")
DOCK_NOT_IN_DB, DOCK_NOT_VALID = 901, 902


@dataclass(frozen=True, kw_only=True)
class DockType:
    """Docks of one kind; names are SimpleChargingDock's, and so are defaults unless said otherwise."""

    is_charger: bool = False
    """Whether docking ends only when the battery is charged."""
    detection: str = "face"
    """What tells where the dock is: none (the map), face (a line in the scan), box (that and a box)."""
    use_external_detection_pose: bool = False
    """Whether `detected_dock_pose` tells instead."""
    face_width: float = 0.0
    """Of a box whose edges tell where its middle is [m]; 0: its middle is where the map says."""
    external_detection_timeout: float = 1.0
    """A pose on `detected_dock_pose` older than this is none [s]."""
    external_detection_translation_x: float = -0.55
    """From the detected pose to where the base stands when docked, along x into the dock [m]; Nav2: -0.2."""
    external_detection_translation_y: float = 0.0
    """The same to the left [m]."""
    external_detection_rotation_yaw: float = 0.0
    """The same as a rotation [rad]."""
    staging_x_offset: float = -0.75
    """From the docked pose to the staging pose, along x [m]; Nav2: -0.7."""
    staging_yaw_offset: float = 0.0
    """Heading at the staging pose, from that of the docked pose [rad]."""
    docking_threshold: float = 0.05
    """A robot so near to the docked pose is docked [m]."""
    use_battery_status: bool = False
    """Whether `battery_state` tells that a charger charges, else being docked does; Nav2: true."""
    charging_threshold: float = 0.5
    """A larger current is charging [A]."""

    def __post_init__(self) -> None:
        if self.detection not in DETECTIONS:
            raise ValueError(f"detection must be one of {', '.join(DETECTIONS)}, not '{self.detection}'")

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

    types: Mapping[str, DockType] = field(default_factory=lambda: dict(_TYPES))
    docks: Mapping[str, Dock] = field(default_factory=dict)

    def find(self, dock_id: str) -> Dock:
        """Return a dock.

        Raises:
            DockError: there is none of this name.
        """
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
