"""The arena file: a hall, its racks, goods and zones as YAML, and everything that can be wrong with it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from twin.errors import nearest
from twin.geometry import Pose2
from twin.parameters import Kilograms, Metres, Radians
from twin.perception.tags.families import FAMILIES
from twin.strict_yaml import Fault, Faults, StrictModel
from twin.warehouse.footprint import Rectangle, overlap

RACK_TAGS: Literal["tag36h11"] = "tag36h11"
"""The family of those on racks; it is printed without OpenCV."""
TAG_SHARE = 0.75
"""Size of a tag for each metre of the sign beside it."""
TAG_GAP = 0.05
"""From the sign to what is beside it [m]."""
Length = Annotated[Metres, Field(gt=0.0)]
Point = tuple[Metres, Metres]
PoseList = tuple[Metres, Metres, Radians]
Interval = tuple[Metres, Metres]
Colour = Literal["red", "yellow", "green", "blue", "orange", "grey", "white", "wood"]


class Hall(StrictModel):
    """The outer walls; coordinates are those of their inner faces, in the map frame."""

    x: Interval
    y: Interval
    wall_height: Length = 1.0
    wall_thickness: Length = 0.2
    walls: bool = True
    """False: a floor of this extent, open on all sides."""

    @model_validator(mode="after")
    def _ordered(self) -> Hall:
        for axis, (low, high) in (("x", self.x), ("y", self.y)):
            if low >= high:
                text = f"hall.{axis} must go from low to high, not {low:g} to {high:g}"
                raise Faults([Fault((axis,), text)])
        return self

    @property
    def rectangle(self) -> Rectangle:
        """The floor."""
        centre = Pose2((self.x[0] + self.x[1]) / 2.0, (self.y[0] + self.y[1]) / 2.0, 0.0)
        return Rectangle(centre, self.x[1] - self.x[0], self.y[1] - self.y[0])


class PartitionEntry(StrictModel):
    """A straight inner wall between two points."""

    start: Point
    end: Point
    height: Length = 1.0
    thickness: Length = 0.1


class PillarEntry(StrictModel):
    """A rectangular pillar."""

    pose: PoseList
    size: tuple[Length, Length] = (0.4, 0.4)
    height: Length = 2.0


class RackEntry(StrictModel):
    """A rack with goods on levels; x of its pose points out of its front.

    From the floor to the lowest level it is solid, so a lidar near the floor sees its outline.
    """

    pose: PoseList
    length: Length
    """Along y of the pose."""
    depth: Length
    """Along x of the pose."""
    levels: Annotated[tuple[Length, ...], Field(min_length=1)]
    """Heights of the surfaces."""
    slot_spacing: Length = 0.6
    bay: Length = 3.0
    """Distance of the uprights."""
    headroom: Length = 0.35
    """Height of the uprights above the highest surface."""
    first_tag: Annotated[int, Field(ge=0)] | None = None
    """Id of the AprilTag (`tag36h11`) beside the sign of the first bay, the next ones of the others: those in
    front, then those behind, each from left to right as seen from the front. Absent: no tags."""

    @property
    def bays(self) -> int:
        """How many there are."""
        return max(1, round(self.length / self.bay))

    @property
    def sign_height(self) -> float:
        """Of the sign on each bay, which is twice as wide, and of the tag with its white border [m]."""
        return min(0.16, 0.7 * self.levels[0])


class PalletEntry(StrictModel):
    """A EUR pallet (1.2 m × 0.8 m) with a load."""

    pose: PoseList
    load: Annotated[Metres, Field(ge=0.1)] = 0.7
    """Height of the load above the deck; without one a lidar near the floor would not see the pallet."""


class ObstacleEntry(StrictModel):
    """A box that always stands there, and is on the map."""

    pose: PoseList
    size: tuple[Length, Length, Length]
    colour: Colour = "grey"


class CylindersEntry(StrictModel):
    """Cylinders of one size that stand upright; they may touch each other."""

    centres: Annotated[tuple[Point, ...], Field(min_length=1)]
    radius: Length
    height: Length = 1.0
    colour: Colour = "grey"

    def covers(self, x: float, y: float) -> bool:
        """Return whether a point [m] is inside one of them."""
        return min(math.dist((x, y), centre) for centre in self.centres) <= self.radius


class ToteKind(StrictModel):
    """What all totes have in common."""

    depth: Length = 0.30
    """Along the rack's depth."""
    width: Length = 0.24
    """Along the rack's length; the gripper closes on these two sides."""
    height: Length = 0.18
    mass: Annotated[Kilograms, Field(gt=0.0)] = 2.5
    friction: Annotated[float, Field(gt=0.0)] = 0.6
    inset: Annotated[Metres, Field(ge=0.0)] = 0.05
    """From the front edge of the surface to the tote's front face."""


class ToteEntry(StrictModel):
    """A tote that a mission can name."""

    rack: str
    level: int
    """0 is the lowest."""
    slot: int
    """0 is the leftmost, seen from the front."""
    colour: Colour = "red"
    depth: Length | None = None
    """Of this one; absent: that of `tote`."""
    width: Length | None = None
    """Likewise."""
    height: Length | None = None
    """Likewise."""
    mass: Annotated[Kilograms, Field(gt=0.0)] | None = None
    """Likewise."""


class Stock(StrictModel):
    """Scenery totes in the other slots."""

    fill: Annotated[float, Field(ge=0.0, le=1.0)] = 0.75
    """Fraction of the other slots."""


class TableEntry(StrictModel):
    """A solid table onto which totes are set; x of its pose points to where a robot stands."""

    pose: PoseList
    length: Length = 1.6
    """Along y of the pose."""
    depth: Length = 0.6
    """Along x of the pose."""
    height: Length = 0.4
    slot_spacing: Length = 0.5


class ZoneEntry(StrictModel):
    """A rectangle painted on the floor."""

    pose: PoseList
    """Its centre, and how a robot should stand there."""
    size: tuple[Length, Length]
    """Along x and y of the pose."""
    colour: Colour = "yellow"
    table: TableEntry | None = None


class ArenaFile(StrictModel):
    """An arena, in metres and radians in the map frame; a pose is a list of x, y, yaw."""

    name: str
    hall: Hall
    partitions: dict[str, PartitionEntry] = Field(default_factory=dict)
    pillars: dict[str, PillarEntry] = Field(default_factory=dict)
    racks: dict[str, RackEntry] = Field(default_factory=dict)
    pallets: dict[str, PalletEntry] = Field(default_factory=dict)
    obstacles: dict[str, ObstacleEntry] = Field(default_factory=dict)
    cylinders: dict[str, CylindersEntry] = Field(default_factory=dict)
    tote: ToteKind = ToteKind()
    totes: dict[str, ToteEntry] = Field(default_factory=dict)
    stock: Stock | None = None
    zones: dict[str, ZoneEntry] = Field(default_factory=dict)
    poses: dict[str, PoseList] = Field(default_factory=dict)

    def kind_of(self, name: str) -> ToteKind:
        """Return size and mass of a tote that a mission can name."""
        own = self.totes[name].model_dump(include={"depth", "width", "height", "mass"}, exclude_none=True)
        return self.tote.model_copy(update=own)

    @model_validator(mode="after")
    def _consistent(self) -> ArenaFile:
        faults = [*_names(self), *_racks(self), *_tags(self), *_totes(self), *_places(self), *_overlaps(self)]
        if faults:
            raise Faults(faults)
        return self


def slot_count(length: float, spacing: float) -> int:
    """Return how many slots of `spacing` fit into `length`."""
    return int(length / spacing + 1e-9)


_SECTIONS = ("partitions", "pillars", "racks", "pallets", "obstacles", "cylinders", "totes", "zones")


def _names(arena: ArenaFile) -> Iterator[Fault]:
    """Every thing needs its own name: the physics and the recording know things by name only."""
    seen = {"floor": "every arena", "walls": "every arena"}
    for section in _SECTIONS:
        for name in getattr(arena, section):
            if "/" in name or "#" in name:
                yield Fault((section, name), f"the name '{name}' must not contain '/' or '#'")
            if name in seen:
                text = f"the name '{name}' is already taken in {seen[name]}; choose another"
                yield Fault((section, name), text)
            seen.setdefault(name, section)


def _racks(arena: ArenaFile) -> Iterator[Fault]:
    for name, rack in arena.racks.items():
        levels = rack.levels
        kinds = [arena.tote, *(arena.kind_of(own) for own, tote in arena.totes.items() if tote.rack == name)]
        height, width = max(kind.height for kind in kinds), max(kind.width for kind in kinds)
        if any(low >= high for low, high in pairwise(levels)):
            yield Fault(("racks", name, "levels"), f"levels of rack '{name}' must rise, not {list(levels)}")
        elif any(high - low < height + 0.1 for low, high in pairwise(levels)):
            text = f"levels of rack '{name}' must be {height + 0.1:g} m apart or more to lift a tote out"
            yield Fault(("racks", name, "levels"), text)
        if width > rack.slot_spacing:
            text = f"a tote is {width:g} m wide and a slot of rack '{name}' {rack.slot_spacing:g} m; "
            text += f"slot_spacing must be at least {width:g}"
            yield Fault(("racks", name, "slot_spacing"), text)
        if (depth := max(kind.inset + kind.depth for kind in kinds)) > rack.depth:
            text = f"a tote needs {depth:g} m of depth and rack '{name}' has {rack.depth:g} m"
            yield Fault(("racks", name, "depth"), text)


def _tags(arena: ArenaFile) -> Iterator[Fault]:
    total, taken = FAMILIES[RACK_TAGS].total, dict[int, str]()
    for name, rack in arena.racks.items():
        if rack.first_tag is None:
            continue
        first, last = rack.first_tag, rack.first_tag + 2 * rack.bays - 1
        here = f"the tags of rack '{name}', {first} to {last},"
        other = next((taken[number] for number in range(first, last + 1) if number in taken), None)
        needed = 2.0 * (2.0 * rack.sign_height + TAG_GAP)  # the sign is in the middle
        if last >= total:
            text = f"{here} are not all of {RACK_TAGS}; its ids end at {total - 1}"
            yield Fault(("racks", name, "first_tag"), text)
        elif other is not None:
            text = f"{here} are also on rack '{other}'; choose another first_tag"
            yield Fault(("racks", name, "first_tag"), text)
        elif rack.length / rack.bays < needed:
            text = f"a bay of rack '{name}' is {rack.length / rack.bays:g} m wide and has no room for a tag "
            text += f"beside its sign; bay must be at least {needed:.3g}"
            yield Fault(("racks", name, "first_tag"), text)
        taken.update(dict.fromkeys(range(first, last + 1), name))


def _totes(arena: ArenaFile) -> Iterator[Fault]:
    taken: dict[tuple[str, int, int], str] = {}
    for name, tote in arena.totes.items():
        rack = arena.racks.get(tote.rack)
        if rack is None:
            hint = nearest(tote.rack, arena.racks)
            yield Fault(("totes", name, "rack"), f"tote '{name}': unknown rack '{tote.rack}'; {hint}")
            continue
        place = (tote.rack, tote.level, tote.slot)
        counts = {"level": len(rack.levels), "slot": slot_count(rack.length, rack.slot_spacing)}
        for key, index, count in zip(counts, place[1:], counts.values(), strict=True):
            if not 0 <= index < count:
                text = f"tote '{name}': rack '{tote.rack}' has no {key} {index}; valid: 0 to {count - 1}"
                yield Fault(("totes", name, key), text)
        if place in taken:
            text = f"tote '{name}' stands where tote '{taken[place]}' is; choose another slot"
            yield Fault(("totes", name, "slot"), text)
        taken.setdefault(place, name)


def _solids(arena: ArenaFile) -> Iterator[tuple[tuple[str, ...], str, Rectangle]]:
    """Yield where each thing is in the file, what it is called, and what it covers of the floor."""
    for section in ("pillars", "racks", "pallets", "obstacles"):
        for name, entry in getattr(arena, section).items():
            yield (section, name), f"{section[:-1]} '{name}'", covered(entry)
    for name, zone in arena.zones.items():
        if zone.table is not None:
            yield ("zones", name, "table"), f"table of zone '{name}'", covered(zone.table)


def covered(entry: PillarEntry | RackEntry | PalletEntry | ObstacleEntry | TableEntry) -> Rectangle:
    """Return what a thing covers of the floor."""
    if isinstance(entry, RackEntry | TableEntry):
        return Rectangle(Pose2(*entry.pose), entry.depth, entry.length)
    x, y = (1.2, 0.8) if isinstance(entry, PalletEntry) else entry.size[:2]
    return Rectangle(Pose2(*entry.pose), x, y)


def _places(arena: ArenaFile) -> Iterator[Fault]:
    """Everything is in the hall, and nobody is told to stand inside something."""
    hall = arena.hall.rectangle
    extent = f"x {arena.hall.x[0]:g} to {arena.hall.x[1]:g}, y {arena.hall.y[0]:g} to {arena.hall.y[1]:g}"
    for loc, what, rectangle in _solids(arena):
        if not hall.contains(rectangle.corners):
            yield Fault((*loc, "pose"), f"{what} reaches out of the hall ({extent})")
    for name, group in arena.cylinders.items():
        r = group.radius
        for index, (x, y) in enumerate(group.centres):
            if not hall.contains([[x - r, y - r], [x + r, y + r]]):
                text = f"a cylinder of '{name}' at ({x:g}, {y:g}) reaches out of the hall ({extent})"
                yield Fault(("cylinders", name, "centres", index), text)
    stands: list[tuple[tuple[str, ...], str, PoseList]]
    stands = [(("zones", n, "pose"), f"zone '{n}'", z.pose) for n, z in arena.zones.items()]
    stands += [(("poses", n), f"pose '{n}'", pose) for n, pose in arena.poses.items()]
    for loc, what, pose in stands:
        if not hall.contains([pose[:2]]):
            yield Fault(loc, f"{what} is outside of the hall ({extent})")
        for _, solid, rectangle in _solids(arena):
            if rectangle.contains([pose[:2]]):
                yield Fault(loc, f"{what} is inside {solid}; move one of them")
        for name, group in arena.cylinders.items():
            if group.covers(*pose[:2]):
                yield Fault(loc, f"{what} is inside a cylinder of '{name}'; move one of them")


def _overlaps(arena: ArenaFile) -> Iterator[Fault]:
    solids = list(_solids(arena))
    for index, (loc, what, rectangle) in enumerate(solids):
        for _, other, before in solids[:index]:
            if overlap(rectangle, before):
                yield Fault((*loc, "pose"), f"{what} overlaps {other}; move one of them")
