"""Racks and tables: surfaces with slots in which totes stand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.geometry import Pose2, Pose3
from twin.sim.scene import Rgba
from twin.warehouse.footprint import Rectangle


@dataclass(frozen=True, kw_only=True)
class Slot:
    """A place for one tote, on a level of a rack or on a table."""

    shelf: str
    level: int
    index: int
    """From left to right, seen from the front."""
    T_map_slot: Pose3
    """On the surface, at the middle of the slot's front edge; x points out of the front, z up."""

    @property
    def name(self) -> str:
        """`<shelf>/<level>/<index>`."""
        return f"{self.shelf}/{self.level}/{self.index}"

    @property
    def height(self) -> float:
        """Of the surface above the floor [m]."""
        return float(self.T_map_slot.xyz[2])

    def approach(self, distance: float) -> Pose2:
        """Return the pose in the map, `distance` [m] before the front edge, that faces the slot."""
        return self.T_map_slot.to_pose2() @ Pose2(distance, 0.0, np.pi)

    def standing(self, depth: float, height: float, inset: float) -> Pose3:
        """Return the pose in the map of the centre of a box that stands here, `inset` behind the edge [m]."""
        return self.T_map_slot @ Pose3.from_xyz_rpy((-inset - depth / 2.0, 0.0, height / 2.0))


@dataclass(frozen=True, kw_only=True)
class Shelf:
    """A rack, or a table (one level)."""

    name: str
    pose: Pose2
    """Of the centre of its footprint in the map; x points out of its front."""
    depth: float
    """Along x of the pose [m]."""
    length: float
    """Along y of the pose [m]."""
    levels: tuple[float, ...]
    """Heights of the surfaces [m]."""
    slot_spacing: float
    """[m]"""
    slots_per_level: int

    @property
    def footprint(self) -> Rectangle:
        """What it covers of the floor."""
        return Rectangle(self.pose, self.depth, self.length)

    def slot(self, level: int, index: int) -> Slot:
        """Return a slot; indices are those of the file, already checked."""
        along = (index - (self.slots_per_level - 1) / 2.0) * self.slot_spacing
        front = self.pose @ Pose2(self.depth / 2.0, along, 0.0)
        return Slot(
            shelf=self.name, level=level, index=index, T_map_slot=Pose3.from_pose2(front, self.levels[level])
        )

    def slots(self) -> tuple[Slot, ...]:
        """Return all slots, level by level from below."""
        indices = range(self.slots_per_level)
        return tuple(self.slot(level, index) for level in range(len(self.levels)) for index in indices)


@dataclass(frozen=True, kw_only=True)
class Tote:
    """A tote that a mission can name."""

    name: str
    slot: Slot
    T_map_tote: Pose3
    """Nominal pose of its centre: x points out of the rack, z up. The real one differs by a seeded error."""
    size: tuple[float, float, float]
    """Depth, width, height along x, y, z [m]; grip it on the two sides across y."""
    mass: float
    """[kg]"""
    friction: float
    """Coulomb coefficient."""
    rgba: Rgba

    def approach(self, distance: float) -> Pose2:
        """Return the pose in the map, `distance` [m] before the shelf's front edge, that faces the tote."""
        return self.slot.approach(distance)


@dataclass(frozen=True, kw_only=True)
class Zone:
    """A rectangle painted on the floor, with or without a table."""

    name: str
    pose: Pose2
    """Its centre, and how a robot should stand there."""
    area: Rectangle
    rgba: Rgba
    table: Shelf | None

    def contains(self, x: float, y: float) -> bool:
        """Return whether a point of the map [m] lies in the zone."""
        return self.area.contains([[x, y]])

    @property
    def slots(self) -> tuple[Slot, ...]:
        """Places for totes on the table, from left to right; none without a table."""
        return () if self.table is None else self.table.slots()
