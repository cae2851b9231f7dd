"""What the robots of a warehouse dock at, beside chargers."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from twin.navigation.docking.docks import DockType

TOTE_POSES = "tote_poses"
"""Topic of the totes that `/tote_detector` sees."""

DOCK_TYPES: Mapping[str, DockType] = MappingProxyType(
    {"tote": DockType(detection="box"), "shelf": DockType(), "table": DockType()}
)
"""By name."""
