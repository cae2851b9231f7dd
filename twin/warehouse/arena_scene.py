"""The shapes of an arena: walls, racks, pallets, tables, totes, paint."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache, lru_cache, partial
from itertools import pairwise
from pathlib import Path
from string import ascii_uppercase
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from twin.files.kept import hash_of
from twin.geometry import Pose2, Pose3
from twin.models.shapes import Box, Cylinder
from twin.sim.looks import materials
from twin.sim.looks.kept_pictures import kept_picture
from twin.sim.looks.tags import tag_decal
from twin.sim.noise import NoiseStream
from twin.sim.scene import Decal, FreeBody, Rgba, Shape, StaticBody
from twin.warehouse.arena_file import (
    RACK_TAGS,
    TAG_GAP,
    TAG_SHARE,
    CylindersEntry,
    PartitionEntry,
    RackEntry,
    ToteKind,
)

if TYPE_CHECKING:
    from twin.warehouse.arena import Arena
    from twin.warehouse.shelf import Shelf, Zone

PALETTE: MappingProxyType[str, Rgba] = MappingProxyType(
    {
        "red": (0.78, 0.16, 0.14, 1.0),
        "yellow": (0.95, 0.76, 0.12, 1.0),
        "green": (0.22, 0.62, 0.28, 1.0),
        "blue": (0.13, 0.37, 0.66, 1.0),
        "orange": (0.93, 0.46, 0.10, 1.0),
        "grey": (0.55, 0.57, 0.60, 1.0),
        "white": (0.93, 0.94, 0.95, 1.0),
        "wood": (0.76, 0.60, 0.42, 1.0),
    }
)
_WALL: Rgba = (0.86, 0.87, 0.88, 1.0)
_PARTITION: Rgba = (0.72, 0.80, 0.84, 1.0)
_PLINTH: Rgba = (0.30, 0.33, 0.37, 1.0)
_BOARD: Rgba = (0.80, 0.81, 0.80, 1.0)
_TAPE: Rgba = (0.62, 0.47, 0.31, 1.0)
_CARDBOARD: Rgba = (0.72, 0.56, 0.38, 1.0)
_STOCK: tuple[Rgba, ...] = (
    (0.33, 0.47, 0.60, 1.0),
    (0.40, 0.52, 0.60, 1.0),
    (0.52, 0.56, 0.60, 1.0),
    (0.63, 0.64, 0.63, 1.0),
)
_GRIPPER_ROOM = 0.15
"""Free on each side of a tote [m]."""
_BOARD_THICKNESS = 0.03
_UPRIGHT = 0.05
_PAINT = 0.002
"""Paint stands proud of what it is on by this much, or a renderer could not tell which is in front [m]."""
_STRIPE = 0.06
_STUCK = 0.001
"""How far decals are in front of what they are on [m]."""
_UPRIGHT_PICTURE = Pose3.from_xyz_rpy((0.0, 0.0, 0.0), (math.pi / 2.0, 0.0, math.pi / 2.0))
"""A picture that faces x, in the frame of what it is on."""
_ORIGIN = Pose2(0.0, 0.0, 0.0)
_DECK = 0.144
"""Height of a EUR pallet [m]."""


def structure(arena: Arena) -> Iterator[StaticBody]:
    """Yield all that is not a tote."""
    file = arena.file
    if file.hall.walls:
        yield _walls(arena)
    for name, partition in file.partitions.items():
        yield _partition(name, partition)
    for name, pillar in file.pillars.items():
        yield _block(name, Pose2(*pillar.pose), (*pillar.size, pillar.height), PALETTE["white"])
    for name, rack in file.racks.items():
        yield rack_body(name, rack)
    for name, pallet in file.pallets.items():
        load, middle = pallet.load, (0.0, 0.0, _DECK + pallet.load / 2.0)
        yield _body(
            name,
            Pose2(*pallet.pose),
            box((1.2, 0.8, _DECK), (0.0, 0.0, _DECK / 2.0), PALETTE["wood"], "wood"),
            box((1.1, 0.74, load), middle, _CARDBOARD, "cardboard"),
            box((1.1 + 2 * _PAINT, 0.08, load + _PAINT), middle, _TAPE, solid=False),
        )
    for name, obstacle in file.obstacles.items():
        yield _block(
            name,
            Pose2(*obstacle.pose),
            obstacle.size,
            PALETTE[obstacle.colour],
            "wood" if obstacle.colour == "wood" else "steel",
        )
    for name, cylinders in file.cylinders.items():
        yield _cylinders(name, cylinders)
    for zone in arena.zones.values():
        yield from _zone(zone)


def decals(arena: Arena) -> Iterator[Decal]:
    """Yield what is painted on the floor, and signs and tags on each bay of a rack, front and back."""
    if arena.file.hall.walls:
        hall = arena.hall
        yield Decal(
            name="floor",
            size=(hall.size_x, hall.size_y),
            T_body_decal=Pose3.from_xyz_rpy((hall.centre.x, hall.centre.y, _STUCK)),
            paint=partial(_floor, arena),
        )
    for letter, (name, entry) in zip(ascii_uppercase, arena.file.racks.items(), strict=False):
        bays, height = entry.bays, entry.sign_height
        z = min(entry.levels[0] / 2.0, 0.25)
        for bay in range(bays):
            along = ((bay + 0.5) / bays - 0.5) * (entry.length - _UPRIGHT)
            for yaw in (0.0, math.pi):
                side = Pose2(*entry.pose) @ Pose2(0.0, 0.0, yaw)
                out = entry.depth / 2.0 + _STUCK
                across = along if yaw == 0.0 else -along
                at = Pose3.from_pose2(side @ Pose2(out, across, 0.0), z)
                yield Decal(
                    name=f"{name} {bay + 1} {'back' if yaw else 'front'}",
                    size=(2.0 * height, height),
                    T_body_decal=at @ _UPRIGHT_PICTURE,
                    paint=partial(_sign, f"{letter}{bay + 1}"),
                )
                if entry.first_tag is not None:
                    number = entry.first_tag + bay + (bays if yaw else 0)
                    beside = side @ Pose2(out, across + 1.5 * height + TAG_GAP, 0.0)
                    yield tag_decal(
                        name=f"{name} tag {number}",
                        family=RACK_TAGS,
                        number=number,
                        size=TAG_SHARE * height,
                        T_world_tag=Pose3.from_pose2(beside, z),
                    )


def _floor(arena: Arena) -> NDArray[np.uint8]:
    def paint() -> NDArray[np.uint8]:
        from twin.warehouse.floor_paint import floor

        return floor(arena.hall, tuple(arena.zones.values()), tuple(arena.racks.values()), arena.structure)

    return kept_picture(f"{_painters()} {arena.file.model_dump_json()}", paint)


def _sign(words: str) -> NDArray[np.uint8]:
    def paint() -> NDArray[np.uint8]:
        from twin.warehouse.floor_paint import sign

        return sign(words)

    return kept_picture(f"{_painters()} sign {words}", paint)


@cache
def _painters() -> str:
    """Return what tells one version of the painters from another, without loading what they need."""
    here = Path(__file__)
    return " ".join(
        str(hash_of(file)) for file in (here, here.with_name("floor_paint.py"), materials.__file__)
    )


@lru_cache(maxsize=8)
def goods(
    arena: Arena, free: frozenset[str], seed: int, jitter: tuple[float, float]
) -> tuple[tuple[StaticBody, ...], tuple[FreeBody, ...]]:
    """Return stock and named totes that cannot be grasped, and those that can."""
    statics: list[StaticBody] = []
    frees: list[FreeBody] = []
    for tote in arena.totes.values():
        pose = tote.T_map_tote @ _placement_error(seed, tote.name, jitter)
        shapes = tote_shapes(tote.size, tote.rgba)
        if tote.name in free:
            held = {"mass": tote.mass, "friction": tote.friction}
            frees.append(FreeBody(name=tote.name, T_world_body=pose, shapes=shapes, **held))
        else:
            statics.append(StaticBody(name=tote.name, T_world_body=pose, shapes=shapes))
    return (*statics, *_stock(arena, seed, jitter)), tuple(frees)


def _stock(arena: Arena, seed: int, jitter: tuple[float, float]) -> Iterator[StaticBody]:
    """Fill other slots with totes of the same make and with cartons."""
    file, kind = arena.file, arena.file.tote
    taken = {tote.slot.name for tote in arena.totes.values()}
    for rack in arena.racks.values():
        for slot in rack.slots():
            chance, look = NoiseStream(seed, f"stock/{slot.name}").uniform(0, 2)
            if file.stock is None or slot.name in taken or chance >= file.stock.fill:
                continue
            index = int(look * (len(_STOCK) + 2))
            if index < len(_STOCK):
                size = (kind.depth, kind.width, kind.height)
                shapes = tote_shapes(size, _STOCK[index])
            else:
                size = _carton_size(rack, kind)
                shapes = carton_shapes(size)
            pose = slot.standing(size[0], size[2], kind.inset) @ _placement_error(seed, slot.name, jitter)
            yield StaticBody(name=f"stock/{slot.name}", T_world_body=pose, shapes=shapes)


def _carton_size(rack: Shelf, kind: ToteKind) -> tuple[float, float, float]:
    """Return a carton's depth, width and height, as large as leaves a gripper room at a tote beside it."""
    gaps = [high - low for low, high in pairwise(rack.levels)]
    room = 2.0 * rack.slot_spacing - kind.width - 2.0 * _GRIPPER_ROOM
    return (
        min(0.36, rack.depth - 2.0 * kind.inset),
        min(0.42, room, rack.slot_spacing - 0.1),
        min(0.25, *(gap - 0.08 for gap in gaps), 0.25),
    )


def _placement_error(seed: int, name: str, jitter: tuple[float, float]) -> Pose3:
    """Return a tote's own error; it does not depend on other totes, nor on whether this one is free."""
    x, y, yaw = NoiseStream(seed, f"placement/{name}").uniform(0, 3) * 2.0 - 1.0
    return Pose3.from_pose2(Pose2(x * jitter[0], y * jitter[0], yaw * jitter[1]))


def box(
    size: tuple[float, float, float],
    xyz: tuple[float, float, float],
    rgba: Rgba,
    material: str = "",
    *,
    solid: bool = True,
) -> Shape:
    """Return a box with its centre at `xyz` of its body [m]."""
    at = Pose3.from_xyz_rpy(xyz)
    return Shape(geometry=Box(size=size), T_body_geometry=at, rgba=rgba, solid=solid, material=material)


def _block(
    name: str, pose: Pose2, size: tuple[float, float, float], rgba: Rgba, material: str = ""
) -> StaticBody:
    return _body(name, pose, box(size, (0.0, 0.0, size[2] / 2.0), rgba, material))


def _body(name: str, pose: Pose2, *shapes: Shape) -> StaticBody:
    return StaticBody(name=name, T_world_body=Pose3.from_pose2(pose), shapes=shapes)


def _walls(arena: Arena) -> StaticBody:
    hall = arena.file.hall
    (x0, x1), (y0, y1), t, h = hall.x, hall.y, hall.wall_thickness, hall.wall_height
    cx, cy, z = (x0 + x1) / 2.0, (y0 + y1) / 2.0, h / 2.0
    along_x, along_y = (x1 - x0 + 2.0 * t, t, h), (t, y1 - y0, h)
    return _body(
        "walls",
        _ORIGIN,
        box(along_x, (cx, y0 - t / 2.0, z), _WALL, "plaster"),
        box(along_x, (cx, y1 + t / 2.0, z), _WALL, "plaster"),
        box(along_y, (x0 - t / 2.0, cy, z), _WALL, "plaster"),
        box(along_y, (x1 + t / 2.0, cy, z), _WALL, "plaster"),
    )


def _partition(name: str, entry: PartitionEntry) -> StaticBody:
    (x0, y0), (x1, y1) = entry.start, entry.end
    pose = Pose2((x0 + x1) / 2.0, (y0 + y1) / 2.0, math.atan2(y1 - y0, x1 - x0))
    size = (math.hypot(x1 - x0, y1 - y0), entry.thickness, entry.height)
    return _block(name, pose, size, _PARTITION)


def _cylinders(name: str, entry: CylindersEntry) -> StaticBody:
    upright, rgba = Cylinder(radius=entry.radius, length=entry.height), PALETTE[entry.colour]
    places = (Pose3.from_xyz_rpy((x, y, entry.height / 2.0)) for x, y in entry.centres)
    return _body(name, _ORIGIN, *(Shape(geometry=upright, T_body_geometry=at, rgba=rgba) for at in places))


def rack_body(name: str, rack: RackEntry) -> StaticBody:
    """Plinth up to the lowest level, a board for each other level, uprights, painted beams."""
    depth, length = rack.depth, rack.length
    lowest, top = rack.levels[0], rack.levels[-1] + rack.headroom
    shapes = [box((depth, length, lowest), (0.0, 0.0, lowest / 2.0), _PLINTH, "steel")]
    board = (depth - 2.0 * _PAINT, length - 2.0 * _PAINT, _BOARD_THICKNESS)
    shapes += [box(board, (0.0, 0.0, z - _BOARD_THICKNESS / 2.0), _BOARD, "board") for z in rack.levels[1:]]
    beam = (depth + 2.0 * _PAINT, length - 2.0 * _UPRIGHT, 0.055)
    shapes += [
        box(beam, (0.0, 0.0, z - 0.0275 - _PAINT), PALETTE["orange"], "steel", solid=False)
        for z in rack.levels
    ]
    # Uprights stand within the rack's length and depth, front and back, between the bays.
    edge = (length - _UPRIGHT) / 2.0
    post = (_UPRIGHT, _UPRIGHT, top - lowest)
    shapes += [
        box(post, (side * (depth - _UPRIGHT) / 2.0, float(y), (top + lowest) / 2.0), PALETTE["blue"], "steel")
        for y in np.linspace(-edge, edge, rack.bays + 1)
        for side in (-1.0, 1.0)
    ]
    return _body(name, Pose2(*rack.pose), *shapes)


def tote_shapes(size: tuple[float, float, float], rgba: Rgba) -> tuple[Shape, ...]:
    """One solid box, because a grasp needs nothing else; a dark opening, a rim and a label are paint."""
    depth, width, height = size
    light, dark = _mixed(rgba, 1.0, 0.35), _mixed(rgba, 0.0, 0.55)
    p = 2.0 * _PAINT
    return (
        box(size, (0.0, 0.0, 0.0), rgba, "plastic"),
        box((depth + p, width + p, 0.022), (0.0, 0.0, height / 2.0 - 0.01), light, solid=False),
        box((depth - 0.03, width - 0.03, p), (0.0, 0.0, height / 2.0 + 0.001), dark, solid=False),
        box((p, 0.10, 0.06), (depth / 2.0, 0.0, -0.015), PALETTE["white"], solid=False),
    )


def carton_shapes(size: tuple[float, float, float]) -> tuple[Shape, ...]:
    """A box with a tape around it and a label."""
    depth, width, height = size
    p = 2.0 * _PAINT
    return (
        box(size, (0.0, 0.0, 0.0), _CARDBOARD, "cardboard"),
        box((depth + p, 0.05, height + p), (0.0, 0.0, 0.0), _TAPE, solid=False),
        box((p, 0.08, 0.06), (depth / 2.0, width / 4.0, 0.02), PALETTE["white"], solid=False),
    )


def _mixed(rgba: Rgba, grey: float, part: float) -> Rgba:
    r, g, b, a = rgba
    return r + (grey - r) * part, g + (grey - g) * part, b + (grey - b) * part, a


def _zone(zone: Zone) -> Iterator[StaticBody]:
    paint = partial(box, rgba=zone.rgba, solid=False)
    x, y, s = zone.area.size_x, zone.area.size_y, _STRIPE
    along_x, along_y, z = (x, s, _PAINT), (s, y - 2.0 * s, _PAINT), _PAINT / 2.0
    yield _body(
        f"{zone.name}_marking",
        zone.area.centre,
        paint(along_x, (0.0, (s - y) / 2.0, z)),
        paint(along_x, (0.0, (y - s) / 2.0, z)),
        paint(along_y, ((s - x) / 2.0, 0.0, z)),
        paint(along_y, ((x - s) / 2.0, 0.0, z)),
    )
    if zone.table is not None:
        depth, length, height = zone.table.depth, zone.table.length, zone.table.levels[0]
        edge = (depth + 2.0 * _PAINT, length + 2.0 * _PAINT, 0.05)
        yield _body(
            f"{zone.name}_table",
            zone.table.pose,
            box((depth, length, height), (0.0, 0.0, height / 2.0), PALETTE["grey"], "steel"),
            paint(edge, (0.0, 0.0, height - 0.025 - _PAINT)),
        )
