"""Writes the tables of scenarios, checks, arenas, navigation, gymnasium, api: `python docs/reference.py`.

Keys come from the schemas; nodes and parameters from what scenarios/warehouse.yaml builds. The tables of
the hashes and definitions of message types are written, too. With `--check` nothing is written; the exit code
is 1 if something is not up to date.
"""

from __future__ import annotations

import dataclasses
import gc
import json
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, NamedTuple, get_args

from api_reference import api
from rosbags.typesys.stores.ros2_jazzy import FIELDDEFS

from twin.bridge import types
from twin.bridge.bus import Bus
from twin.bridge.node import Node
from twin.bridge.services import Client, Service
from twin.bridge.topics import Publisher, Subscription
from twin.bridge.types.jazzy import TABLE as JAZZY
from twin.bridge.types.type_hash import TABLE as HASHES
from twin.bridge.types.type_hash import rihs01_of
from twin.envs.diff_drive_goal import DiffDriveGoalConfig
from twin.envs.navigation import NavigationConfig, Reward
from twin.envs.randomisation import Randomisation
from twin.envs.warehouse_nav import WarehouseNavConfig
from twin.navigation.control.goal_checker import GoalCheckerConfig
from twin.navigation.control.progress_checker import ProgressCheckerConfig
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
from twin.navigation.docking.config import DockCollisionConfig, DockEstimateConfig
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.navigation.planning.config import ThetaStarConfig
from twin.navigation.recovery import BehaviorConfig
from twin.nodes.navigation.bt_navigator_config import BtNavigatorConfig
from twin.nodes.navigation.controller_server.config import ControllerServerConfig
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.nodes.navigation.docking.config import DockingServerConfig
from twin.nodes.navigation.waypoint_follower import WaypointFollowerConfig
from twin.parameters import units
from twin.parameters.declaration import fields_of
from twin.parameters.texts import texts_of
from twin.runtime.build import build
from twin.scenario.faults import LastingRobotFault
from twin.scenario.schema import json_schema, load
from twin.scenario.signals import SIGNALS
from twin.warehouse.arena_file import ArenaFile

DOCS = Path(__file__).parent
BEGIN, END = "<!-- {name}: written by docs/reference.py -->\n", "<!-- end of {name} -->"

QUANTITIES = {
    part.si: part.quantity
    for hint in vars(units).values()
    for part in get_args(hint)
    if isinstance(part, units.Unit)
}
"""SI unit, the first of a pattern -> what the tables call it."""

ARENA_MEANING = {
    "name": "Name of the arena.",
    "hall": "The outer walls.",
    "partitions": "Inner walls by name.",
    "pillars": "Pillars by name.",
    "racks": "Racks by name.",
    "pallets": "Loaded pallets by name.",
    "obstacles": "Boxes by name; they are on the map.",
    "tote": "What all totes have in common.",
    "totes": "Totes that a mission can name.",
    "stock": "Scenery totes; absent: none.",
    "zones": "Painted rectangles by name.",
    "poses": "Named poses, such as a start.",
    "x": "From low to high.",
    "y": "From low to high.",
    "pose": "x, y, yaw in the map frame.",
    "start": "x, y of one end.",
    "end": "x, y of the other end.",
    "size": "Full edge lengths along the pose's axes.",
    "colour": "Colour of the picture.",
    "table": "A table in the zone, onto which totes are set.",
    "slot_spacing": "Distance between the middles of two slots.",
    "rack": "Name of its rack.",
    "mass": "Mass.",
    "friction": "Coulomb coefficient.",
    "height": "Height.",
    "wall_height": "Height.",
    "wall_thickness": "Thickness, outwards.",
    "thickness": "Thickness.",
}
"""Meaning of keys that the arena schema does not describe."""


ALL_FAULTS = "faults[].<kind>"
COMMON_KEYS = [field.name for field in fields(LastingRobotFault)]
"""Of all faults: told once."""


def tables(schema: Mapping[str, Any], meanings: Mapping[str, str]) -> str:
    """Return one table per kind of mapping in a schema, in the order in which a file nests them."""
    parts = []
    sections = list(_with_all_faults(_sections(schema)))
    homes = {node["title"]: path for path, node in sections}
    for path, node in sections:
        if set(node["properties"]) == {"type"}:
            continue
        heading = f"### `{path}`" if path else "### The file"
        parts += [heading, "", _flow(node.get("description", "")), ""]
        parts += ["| Key | Value | Default | Meaning |", "|---|---|---|---|"]
        required = node.get("required", ())
        common = COMMON_KEYS if path.startswith("faults[].") and path != ALL_FAULTS else ()
        if alike := [f"`{key}`" for key in common if key in node["properties"]]:
            parts.append(f"| {', '.join(alike)} | | | as in `{ALL_FAULTS}` |")
        for key, item in node["properties"].items():
            if key in common:
                continue
            meaning = item.get("description") or meanings.get(key) or _described(schema, item)
            default = "required" if key in required else _default(item)
            elsewhere = [homes.get(name, "") for _, name in _references(item)]
            if (
                len(elsewhere) == 1
                and elsewhere[0]
                and not elsewhere[0].startswith(f"{path}.{key}".strip("."))
            ):
                meaning += f" Keys as in `{elsewhere[0]}`."
            parts.append(f"| `{key}` | {_value(schema, item)} | {default} | {_flow(meaning)} |")
        parts.append("")
    return "\n".join(parts)


def _with_all_faults(
    sections: Iterator[tuple[str, Mapping[str, Any]]],
) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Put a section of what all faults have before the first of them."""
    first = ""
    for path, node in sections:
        if path.startswith("faults[].") and not first:
            first, properties = path, node["properties"]
            described = "What faults have in common; those that happen at once last no time."
            yield (
                ALL_FAULTS,
                {
                    **node,
                    "required": (),
                    "description": described,
                    "properties": {key: properties[key] for key in COMMON_KEYS},
                },
            )
        yield path.replace(f"{first}.when", f"{ALL_FAULTS}.when") if first else path, node


def _sections(schema: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield dotted path and mapping, outer ones first; a mapping that comes again is not repeated."""
    seen: set[str] = set()

    def walk(path: str, node: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
        if node.get("properties"):
            yield path, node
        for key, item in node.get("properties", {}).items():
            for suffix, name in _references(item):
                if name not in seen:
                    seen.add(name)
                    yield from walk(f"{path}.{key}{suffix}".lstrip("."), schema["$defs"][name])

    return walk("", schema)


def _references(item: Mapping[str, Any], suffix: str = "") -> Iterator[tuple[str, str]]:
    """Yield (suffix of the path, name of the definition) for everything that an item may hold."""
    if "$ref" in item:
        yield suffix, item["$ref"].rpartition("/")[2]
    if "discriminator" in item:
        for kind, reference in item["discriminator"]["mapping"].items():
            yield f"{suffix} (type: {kind})", reference.rpartition("/")[2]
        return
    for choice in item.get("anyOf", ()):
        yield from _references(choice, suffix)
    if isinstance(item.get("items"), Mapping):
        yield from _references(item["items"], f"{suffix}[]")
    if isinstance(item.get("additionalProperties"), Mapping):
        yield from _references(item["additionalProperties"], f"{suffix}.<name>")


def _value(schema: Mapping[str, Any], item: Mapping[str, Any]) -> str:
    """Return what a key takes, in words."""
    choices = [choice for choice in item.get("anyOf", (item,)) if choice.get("type") != "null"]
    if len(choices) > 1 and "$ref" in choices[0] and "$ref" not in choices[1]:  # one number can stand for all
        return f"mapping, or {_value(schema, {'anyOf': choices[1:]})}"
    brings = any(choice.get("pattern") == ":" for choice in choices)  # a plugin's name
    units = next((unit for choice in choices if (unit := _unit(choice.get("pattern", "")))), None)
    if units is not None:
        number = next(choice for choice in choices if "pattern" not in choice)
        return QUANTITIES[units] + _bounds(number)
    choice = choices[0]  # of a union, what ships; the rest is a user's
    if "prefixItems" in choice:
        return "list of " + ", ".join(_value(schema, part) for part in choice["prefixItems"])
    if "enum" in choice:
        own = ", or [your own](navigation/plugins.md)" if brings else ""
        return ", ".join(f"`{value}`" for value in choice["enum"]) + own
    if "const" in choice:
        return f"`{choice['const']}`"
    if choice.get("type") == "array":
        return f"list of {_value(schema, choice['items'])}"
    if "discriminator" in choice:
        kinds = [f"`{kind}`" for kind in choice["discriminator"]["mapping"]]
        own = ", or [your own](plugins.md)" if len(choices) > 1 else ""
        return f"mapping with `type`: {', '.join(kinds)}{own}"
    if "additionalProperties" in choice and isinstance(choice["additionalProperties"], Mapping):
        return f"mapping of name to {_value(schema, choice['additionalProperties'])}"
    words = {"string": "text", "integer": "whole number", "number": "number", "boolean": "`true`, `false`"}
    kind = choice.get("type", "object")
    if isinstance(kind, list):
        return "text, number or boolean"
    return words.get(kind, "mapping") + _bounds(choice)


def _bounds(choice: Mapping[str, Any]) -> str:
    """Return the limits of a number as a suffix."""
    texts = {"gt": "> {}", "exclusiveMinimum": "> {}", "ge": "≥ {}", "minimum": "≥ {}", "le": "≤ {}"}
    texts["maximum"] = "≤ {}"
    found = [text.format(f"{choice[key]:g}") for key, text in texts.items() if key in choice]
    return f" {', '.join(found)}" if found else ""


def _unit(pattern: str) -> str:
    """Return the first unit of a pattern, SI; nothing if it has none."""
    match = re.search(r"\\s\*\(([^|)]+)", pattern)
    return match[1].replace("\\", "") if match else ""


def _default(item: Mapping[str, Any]) -> str:
    default = item.get("default")
    if default in (None, [], {}, "") or isinstance(default, dict):
        return "–"
    return f"`{str(default).lower() if isinstance(default, bool) else _plain(default)}`"


def _plain(default: Any) -> str:
    return f"{default:.6g}" if isinstance(default, float) else str(default)


def _described(schema: Mapping[str, Any], item: Mapping[str, Any]) -> str:
    for _, name in _references(item):
        return str(schema["$defs"][name].get("description", ""))
    return ""


def _flow(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


class Parameters(NamedTuple):
    """What a table of parameters shows."""

    title: str
    """Name of the node, and after a comma which of its parameters."""
    config: type[Any]
    prefix: str = ""
    """Of their names in ROS."""
    setters: str = ""
    """Who sets them, if they are no ROS parameters."""


PARAMETERS = (
    Parameters("/amcl", AmclConfig),
    Parameters("/planner_server", ThetaStarConfig, "GridBased."),
    Parameters("/controller_server", ControllerServerConfig),
    Parameters("/controller_server, regulated pure pursuit", RegulatedPurePursuitConfig, "FollowPath."),
    Parameters("/controller_server, goal checker", GoalCheckerConfig, "general_goal_checker."),
    Parameters("/controller_server, progress checker", ProgressCheckerConfig, "progress_checker."),
    Parameters("/behavior_server", BehaviorConfig, setters="a `params_file` sets them"),
    Parameters("/bt_navigator", BtNavigatorConfig),
    Parameters("/waypoint_follower", WaypointFollowerConfig),
    Parameters("/docking_server", DockingServerConfig),
    Parameters("/docking_server, sights of the dock", DockEstimateConfig, "estimate."),
    Parameters("/docking_server, what is in the way", DockCollisionConfig, "controller."),
)


def stack() -> tuple[str, str]:
    """Return the tables of nodes and of parameters, as the warehouse scenario builds them."""
    parts = build(load(DOCS.parent / "scenarios" / "warehouse.yaml"))
    try:
        return _nodes(parts.bus), _parameters(parts.bus)
    finally:
        parts.bus.close()


def _nodes(bus: Bus) -> str:
    lines = ["| Node | Publishes | Subscribes | Serves | Calls |", "|---|---|---|---|---|"]
    for node in bus.nodes:
        cells = []
        for kind in (Publisher, Subscription):
            topics = [endpoint.name for endpoint in node._endpoints if type(endpoint) is kind]
            cells.append(_names(name for name in topics if "/_action/" not in name and name != "/rosout"))
        cells += [
            _names(endpoint.name for endpoint in node._endpoints if type(endpoint) is kind)
            for kind in (Service, Client)
        ]
        lines.append(f"| `{node.fully_qualified_name}` | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _names(names: Iterator[str]) -> str:
    """Return names as a cell; the five endpoints of an action are one name."""
    found = dict.fromkeys(
        f"`{name.partition('/_action/')[0]}`" + (" (action)" if "/_action/" in name else "") for name in names
    )
    return ", ".join(found)


def _parameters(bus: Bus) -> str:
    gc.collect()
    alive = gc.get_objects()
    nodes = {node.fully_qualified_name: node for node in bus.nodes}
    lines = []
    for shown in PARAMETERS:
        found = [item for item in alive if type(item) is shown.config]
        # Defaults of dataclass fields are alive, too; what the robot has is another one, or the same.
        config = next((item for item in found if item != shown.config()), found[0])
        lines += _table(shown, config, nodes[shown.title.partition(",")[0]])
    costmaps = {item.name: item.layers for item in alive if type(item) is CostmapNodeConfig}
    for name, layers in sorted(costmaps.items()):
        setters = "the scenario or a `params_file` sets them"
        shown = Parameters(f"/{name}/{name}", type(layers), setters=setters)
        lines += _table(shown, layers, nodes[shown.title])
    return "\n".join(lines)


def _table(shown: Parameters, config: Any, node: Node) -> list[str]:
    """Return a table with names and values as the node declares them, if it does."""
    lines = [f"### `{shown.title}`", ""]
    if shown.prefix:
        lines += [f"All names begin with `{shown.prefix}`.", ""]
    if shown.setters:
        lines += [f"No ROS parameters: {shown.setters}.", ""]
    lines += ["| Parameter | Value | Meaning |", "|---|---|---|"]
    for field, declaration in fields_of(config).items():
        value, name = getattr(config, field), declaration.name
        if field in ("footprint", "robot_radius") or not isinstance(value, bool | int | float | str):
            continue
        value = declaration.tell(value) if shown.setters else node.get_parameter(shown.prefix + name).value
        text = str(value).lower() if isinstance(value, bool) else _plain(value)
        lines.append(f"| `{name}` | {text} | {_flow(declaration.text)} |")
    return [*lines, ""]


def environments() -> str:
    """Return the tables of what can be set of environments, without what another table has."""
    lines: list[str] = []
    inherited = {field.name for field in dataclasses.fields(NavigationConfig)}
    for config, left_out in (
        (Randomisation, set()),
        (NavigationConfig, {"randomisation", "reward", "robot"}),
        (Reward, set()),
        (DiffDriveGoalConfig, inherited - {"robot"}),
        (WarehouseNavConfig, inherited - {"robot", "goal_range"}),
    ):
        texts = texts_of(config)
        lines += [f"`{config.__name__}`:", "", "| Field | Default | Meaning |", "|---|---|---|"]
        for field in dataclasses.fields(config):
            if field.name not in left_out:
                default = "as the patrol's" if field.name == "walkers" else _plain_python(field.default)
                lines.append(f"| `{field.name}` | {default} | {_flow(texts[field.name])} |")
        lines.append("")
    return "\n".join(lines)


def _plain_python(default: object) -> str:
    if not isinstance(default, tuple):
        return str(default)
    nested = isinstance(default[0], tuple)
    return (", " if nested else " x ").join(map(_plain_python, default))


def updated(page: str, name: str, content: str) -> str:
    """Return a page with the part between the two marks of `name` replaced."""
    begin, end = BEGIN.format(name=name), END.format(name=name)
    head, found, rest = page.partition(begin)
    _, closed, tail = rest.partition(end)
    assert found, f"the page has no mark {begin!r}"
    assert closed, f"the page has no mark {end!r}"
    return f"{head}{begin}\n{content}\n{end}{tail}"


def pages() -> dict[Path, str]:
    """Return the pages as they should be."""
    scenarios, arenas, navigation = (DOCS / f"{name}.md" for name in ("scenarios", "arenas", "navigation"))
    nodes, parameters = stack()
    text = updated(navigation.read_text("utf-8"), "nodes", nodes)
    return {
        navigation: updated(text, "parameters", parameters),
        DOCS / "gymnasium.md": updated(
            (DOCS / "gymnasium.md").read_text("utf-8"), "environments", environments()
        ),
        DOCS / "api.md": updated((DOCS / "api.md").read_text("utf-8"), "names", api()),
        scenarios: updated(scenarios.read_text("utf-8"), "scenario keys", tables(json_schema(), {})),
        DOCS / "checks.md": updated((DOCS / "checks.md").read_text("utf-8"), "signals", signals()),
        arenas: updated(
            arenas.read_text("utf-8"), "arena keys", tables(ArenaFile.model_json_schema(), ARENA_MEANING)
        ),
        JAZZY: "{\n" + ",\n".join(f'"{name}": {json.dumps(of)}' for name, of in FIELDDEFS.items()) + "\n}\n",
        HASHES: json.dumps({"note": "written by docs/reference.py", "hashes": hashes()}, indent=0) + "\n",
    }


def signals() -> str:
    """Return the table of the simulator's signals."""
    rows = ["| Signal | Unit | Meaning |", "|---|---|---|"]
    units_of = {bool: "true or false", str: "text"}
    for name in SIGNALS.shipped:
        signal = SIGNALS.find(name).load()
        arguments = ", ".join(argument for argument, _ in signal.takes)
        called = f"{name}({arguments})" if arguments else name
        unit = units_of.get(signal.kind, signal.unit) or "–"
        rows.append(f"| `{called}` | {unit} | {_flow(signal.__doc__ or '')} |")
    return "\n".join(rows)


def hashes() -> dict[str, str]:
    """Return the hash of every type that an endpoint may have: also of the parts of actions that travel."""
    parts = ("", "_SendGoal", "_GetResult", "_FeedbackMessage")
    travelling = [name + part for name in types.names() for part in (parts if "/action/" in name else ("",))]
    return {name: rihs01_of(name, types.definitions(name)) for name in travelling}


def main() -> int:
    """Write the pages, or with --check only compare them."""
    stale = [path for path, text in pages().items() if path.read_text("utf-8") != text]
    if "--check" in sys.argv[1:]:
        sys.stderr.writelines(f"{path}: not up to date, run python docs/reference.py\n" for path in stale)
        return 1 if stale else 0
    for path, text in pages().items():
        path.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
