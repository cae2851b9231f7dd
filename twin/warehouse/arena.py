"""An arena: a hall with racks, goods and zones, from YAML to a scene."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import cached_property, lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import TypeVar

from twin import strict_yaml
from twin.errors import ScenarioError, nearest
from twin.files.kept import hash_of
from twin.geometry import Pose2
from twin.sim.scene import Decal, Scene, StaticBody
from twin.warehouse.arena_file import ArenaFile, RackEntry, TableEntry, slot_count
from twin.warehouse.arena_scene import PALETTE, decals, goods, structure
from twin.warehouse.catalogue import catalogue
from twin.warehouse.footprint import Rectangle
from twin.warehouse.shelf import Shelf, Slot, Tote, Zone

T = TypeVar("T")

TOTE_JITTER = (0.015, 0.03)
"""Largest error of a tote's placement along x and y [m] and in yaw [rad]."""


def load(name_or_path: str | Path) -> Arena:
    """Read an arena.

    Args:
        name_or_path: A name of `twin arenas`, or a file.

    Raises:
        ScenarioError: With every problem of the file, each with its line.
    """
    return _read(_file(name_or_path))


def shared(name_or_path: str | Path) -> Arena:
    """Return what `load` does, the same arena for the same content: for runs, which change nothing in it."""
    path = _file(name_or_path)
    return _kept(path, hash_of(path))


@lru_cache(maxsize=8)
def _kept(path: Path, _content: str | None) -> Arena:
    return _read(path)


def _read(path: Path) -> Arena:
    return Arena(strict_yaml.load(path, ArenaFile, error=ScenarioError))


def _file(name_or_path: str | Path) -> Path:
    known = catalogue()
    path = known.get(str(name_or_path), Path(name_or_path))
    if not path.is_file():
        raise ScenarioError(
            f"no arena '{name_or_path}': neither a file nor known; {nearest(str(name_or_path), known)}"
        )
    return path


class Arena:
    """A hall, its racks with slots, its named totes, its zones; all poses are in the map frame."""

    def __init__(self, file: ArenaFile) -> None:
        self.file = file
        self.name = file.name
        racks = {name: _shelf(name, rack, rack.levels) for name, rack in file.racks.items()}
        self.racks: Mapping[str, Shelf] = MappingProxyType(racks)
        self.totes: Mapping[str, Tote] = MappingProxyType({name: self._tote(name) for name in file.totes})
        self.zones: Mapping[str, Zone] = MappingProxyType({name: self._zone(name) for name in file.zones})
        self.poses: Mapping[str, Pose2] = MappingProxyType({n: Pose2(*p) for n, p in file.poses.items()})

    def with_moved(self, name: str, by: Pose2) -> Arena:
        """Return the arena with one of its parts elsewhere, and with it what stands on that.

        Args:
            name: Of a rack, pallet, pillar or obstacle.
            by: How far it is moved along the axes of `map`, and turned about its own origin.

        Raises:
            ScenarioError: No such part.
        """
        groups = ("racks", "pallets", "pillars", "obstacles")
        parts = {part: group for group in groups for part in getattr(self.file, group)}
        if name not in parts:
            raise ScenarioError(f"arena '{self.name}' has no part '{name}'; {nearest(name, parts)}")
        group = getattr(self.file, parts[name])
        x, y, yaw = group[name].pose
        entry = group[name].model_copy(update={"pose": (x + by.x, y + by.y, yaw + by.yaw)})
        return Arena(self.file.model_copy(update={parts[name]: {**group, name: entry}}))

    @property
    def hall(self) -> Rectangle:
        """The floor between the outer walls."""
        return self.file.hall.rectangle

    def tote(self, name: str) -> Tote:
        """Return a named tote at its nominal pose.

        Raises:
            ScenarioError: No such tote.
        """
        return self._find("tote", name, self.totes)

    def slot(self, name: str) -> Slot:
        """Return a slot by its name `<rack or zone>/<level>/<index>`.

        Raises:
            ScenarioError: No such slot.
        """
        return self._find("slot", name, self._slots)

    def zone(self, name: str) -> Zone:
        """Return a zone.

        Raises:
            ScenarioError: No such zone.
        """
        return self._find("zone", name, self.zones)

    def pose(self, name: str) -> Pose2:
        """Return a named pose.

        Raises:
            ScenarioError: No such pose.
        """
        return self._find("pose", name, self.poses)

    def scene(
        self,
        free_totes: Collection[str] = (),
        *,
        seed: int = 0,
        obstacles: Sequence[StaticBody] = (),
        tote_jitter: tuple[float, float] = TOTE_JITTER,
    ) -> Scene:
        """Return the arena as a scene.

        Args:
            free_totes: Named totes that a robot can grasp; the others are scenery of the same look.
            seed: Of the totes' placement errors and of which other slots are filled.
            obstacles: More things, unknown to the map.
            tote_jitter: Largest placement error along x and y [m] and in yaw [rad]; every tote keeps its own.

        Raises:
            ScenarioError: A free tote is unknown.
        """
        for name in free_totes:
            self.tote(name)
        stock, free = goods(self, frozenset(free_totes), seed, tote_jitter)
        x, y = self.file.hall.x, self.file.hall.y
        return Scene(
            name=self.name,
            floor_size=(2.0 * max(map(abs, x)) + 4.0, 2.0 * max(map(abs, y)) + 4.0),
            statics=(*self.structure, *stock, *obstacles),
            goods=free,
            decals=self.decals,
        )

    @cached_property
    def structure(self) -> tuple[StaticBody, ...]:
        """Everything that is the same in each run: walls, racks, pallets, tables, paint; not the totes."""
        return tuple(structure(self))

    @cached_property
    def decals(self) -> tuple[Decal, ...]:
        """What is painted on the floor, and the signs on racks."""
        return tuple(decals(self))

    # -- from the file ---------------------------------------------------------------------------------------

    def _tote(self, name: str) -> Tote:
        entry, kind = self.file.totes[name], self.file.kind_of(name)
        slot = self.racks[entry.rack].slot(entry.level, entry.slot)
        return Tote(
            name=name,
            slot=slot,
            T_map_tote=slot.standing(kind.depth, kind.height, kind.inset),
            size=(kind.depth, kind.width, kind.height),
            mass=kind.mass,
            friction=kind.friction,
            rgba=PALETTE[entry.colour],
        )

    def _zone(self, name: str) -> Zone:
        entry = self.file.zones[name]
        pose, table = Pose2(*entry.pose), entry.table
        return Zone(
            name=name,
            pose=pose,
            area=Rectangle(pose, *entry.size),
            rgba=PALETTE[entry.colour],
            table=None if table is None else _shelf(name, table, (table.height,)),
        )

    @cached_property
    def _slots(self) -> dict[str, Slot]:
        tables = [zone.table for zone in self.zones.values() if zone.table is not None]
        return {slot.name: slot for shelf in (*self.racks.values(), *tables) for slot in shelf.slots()}

    def _find(self, kind: str, name: str, known: Mapping[str, T]) -> T:
        if name not in known:
            raise ScenarioError(f"arena '{self.name}' has no {kind} '{name}'; {nearest(name, known)}")
        return known[name]


def _shelf(name: str, entry: RackEntry | TableEntry, levels: tuple[float, ...]) -> Shelf:
    return Shelf(
        name=name,
        pose=Pose2(*entry.pose),
        depth=entry.depth,
        length=entry.length,
        levels=levels,
        slot_spacing=entry.slot_spacing,
        slots_per_level=slot_count(entry.length, entry.slot_spacing),
    )
