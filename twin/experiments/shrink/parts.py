"""What can be left out of a scenario, as plain data: list items and keys, the large ones first."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

from twin.strict_yaml import Loc

Data = Mapping[str, Any]

_OF_SCENARIO = {"name", "description", "seed", "duration", "checks", "robots", "mission", "missions", "world"}
_OF_ROBOT = {"model", "name", "start", "pose", "base"}
"""Keys of a robot that are no parameters: without them it would be another situation."""
_OF_WORLD = {"arena"}
_OF_MISSION = {"type", "robot"}


@dataclass(frozen=True)
class Part:
    """Something that is left out, or not."""

    name: str
    """For people: `faults.3 encoder`."""
    locs: tuple[Loc, ...]
    """Where it stands; several places if they make sense together only."""


def causes(data: Data) -> list[Part]:
    """Return what can make a run fail: each fault, obstacle and good, each group of parameters."""
    found = _keys(data, (), _OF_SCENARIO) + _keys(data, ("world",), _OF_WORLD)
    for index, _ in enumerate(data["robots"]):
        found += _keys(data, ("robots", index), _OF_ROBOT)
    return found


def tasks(data: Data) -> list[Part]:
    """Return what robots do, as far as they need not: steps of missions; of several robots each."""
    found = [*_robots(data), *_keys(data, ("mission",), _OF_MISSION)]
    for index, _ in enumerate(data.get("missions", ())):
        found += _keys(data, ("missions", index), _OF_MISSION)
    return found


def inside(data: Data, parts: Iterable[Part]) -> list[Part]:
    """Return the keys of groups of keys; a list item, such as a fault, is there whole or not at all."""
    places = [part.locs[0] for part in parts if len(part.locs) == 1]
    return [child for loc in places if isinstance(loc[-1], str) for child in _children(data, loc)]


def without(data: Data, parts: Iterable[Part]) -> dict[str, Any]:
    """Return data without some parts, and without the lists and groups that are empty then."""
    left = deepcopy(dict(data))
    # From the back, so that indices of what is still to go stay what they are.
    for loc in sorted((loc for part in parts for loc in part.locs), key=_order, reverse=True):
        holder = _at(left, loc[:-1])
        if isinstance(holder, list):
            del holder[int(loc[-1])]
        elif isinstance(holder, dict):
            holder.pop(str(loc[-1]), None)
    if isinstance(left.get("world"), dict):
        left["world"] = {key: value for key, value in left["world"].items() if value != []}
    return {key: value for key, value in left.items() if value not in ([], {})}


def _robots(data: Data) -> Iterator[Part]:
    """Yield each of several robots, with the mission and the faults that name it."""
    robots = data["robots"]
    for index, robot in enumerate(robots) if len(robots) > 1 else ():
        name = robot.get("name") or str(robot.get("model", "")).rpartition("/")[2].partition(".")[0]
        locs: list[Loc] = [("robots", index)]
        for at, mission in enumerate(data.get("missions", ())):
            if mission.get("robot") == name:
                locs.append(("missions", at))
        for at, fault in enumerate(data.get("faults", ())):
            if any(isinstance(value, Mapping) and value.get("robot") == name for value in fault.values()):
                locs.append(("faults", at))
        yield Part(f"robots.{index} {name}", tuple(locs))


def _keys(data: Data, loc: Loc, kept: set[str]) -> list[Part]:
    """Return the items of each list of a mapping, and its other keys, without those that are kept."""
    found: list[Part] = []
    for key, value in _items(_at(data, loc)):
        if key not in kept:
            place = (*loc, key)
            found += _children(data, place) if isinstance(value, list) else [_part(data, place)]
    return found


def _children(data: Data, loc: Loc) -> list[Part]:
    return [_part(data, (*loc, key)) for key, _ in _items(_at(data, loc))]


def _items(value: Any) -> list[tuple[str | int, Any]]:
    if isinstance(value, Mapping):
        return list(value.items())
    return list(enumerate(value)) if isinstance(value, list) else []


def _part(data: Data, loc: Loc) -> Part:
    value = _at(data, loc)
    name = ".".join(map(str, loc))
    if isinstance(value, Mapping) and isinstance(loc[-1], int):
        name = f"{name} {value.get('name') or next(iter(value), '')}"
    elif not isinstance(value, Mapping | list):
        name = f"{name}: {value}"
    return Part(name, (loc,))


def _at(data: Any, loc: Loc) -> Any:
    for key in loc:
        try:
            data = data[key]
        except (KeyError, IndexError, TypeError):
            return None
    return data


def _order(loc: Loc) -> tuple[tuple[bool, int, str], ...]:
    return tuple((isinstance(key, str), key if isinstance(key, int) else 0, str(key)) for key in loc)
