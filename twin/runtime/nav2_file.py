"""One of Nav2's parameter files: names as the nodes here have them, lines, and what became of each value."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import yaml

from twin.bridge.parameters import files
from twin.errors import NavigationError, Problem, TwinError
from twin.nodes.node_parameters import overlay, parameter_names

C = TypeVar("C")

PLANNERS = {
    "NavfnPlanner": "grid_based",
    "SmacPlanner2D": "grid_based",
    "ThetaStarPlanner": "theta_star",
    "SmacPlannerHybrid": "smac_hybrid",
}
"""Nav2's plugin -> the scenario's name of what does the same here."""
_TYPO = 0.85
"""As similar as this to a name that the node has, an unknown name is a mistake; else it is Nav2's alone."""
_ONLY_NAV2S = ("critics", "transform_tolerance")
"""Names of Nav2 that only look like mistakes."""
_LISTS = ("plugins", "plugin", "docks")
"""What these name has sections of its own."""
_DOCKS = ("SimpleChargingDock", "SimpleNonChargingDock")
_LAYERS = ("static_layer", "obstacle_layer", "voxel_layer", "inflation_layer", "stvl_layer", "range_layer")
_BEHAVIORS = ("spin", "backup", "drive_on_heading", "assisted_teleop", "wait")
_SECTIONS = {
    "controller_plugins": "FollowPath",
    "planner_plugins": "GridBased",
    "goal_checker_plugins": "general_goal_checker",
    "progress_checker_plugins": "progress_checker",
}
"""List of plugins -> what the section of the first one is called here."""


class _Value(NamedTuple):
    value: Any
    said: str
    """Its name in the file."""
    line: int | None
    is_general: bool
    """Whether it is for whichever node has it, as what is under a pattern is."""


class Nav2Parameters:
    """The values of one file; remembers what became of each."""

    def __init__(self, path: Path, namespace: str = "") -> None:
        """Read a file.

        Args:
            path: A file as for ROS nodes: `node: {ros__parameters: {...}}`.
            namespace: Of the robot; nodes may be named with it or without.

        Raises:
            NavigationError: the file is no parameter file.
        """
        self.path, self._namespace = path, namespace
        try:
            self._sections = files.read(path)
        except TwinError as error:
            raise NavigationError(error.problems) from error
        self._lines = _lines(path)
        self._problems: list[Problem] = []
        self._ignored: dict[str, list[str]] = {}
        self._nodes: set[str] = set()

    def applied(
        self,
        node: str,
        config: C,
        names: Mapping[str, str] | None = None,
        *,
        prefix: str = "",
        keep: frozenset[str] = frozenset(),
    ) -> C:
        """Return a node's config with the file's values.

        Args:
            node: Its name, such as 'controller_server' or 'local_costmap/local_costmap'.
            config: What holds without the file.
            names: Field -> parameter, as for `declare_config`.
            prefix: Of all parameters of this config, such as 'GridBased.'.
            keep: Parameters, without their sections, that the scenario gives: they stay.
        """
        self._nodes.add(node)
        values = self._values(node, config, names or {}, prefix)
        known = tuple(prefix + name for name in parameter_names(config, names or {}))
        taken = {
            name.removeprefix(prefix): entry.value
            for name, entry in values.items()
            if name in known and not keep & {name, *name.split(".")}
        }
        config, refused = overlay(config, taken, names or {})
        for name, why in refused.items():
            entry = values[prefix + name]
            self._problems.append(Problem(f"{node}: {entry.said} {why}", self.path, entry.line))
        for name, entry in values.items():
            if name not in known and not entry.is_general and name != "use_sim_time":
                self._unknown(node, name, entry, known)
        return config

    def plugin(self, node: str, section: str, key: str = "plugin") -> str:
        """Return the class of a plugin, without its package; '' if the file does not tell."""
        entry = _renamed(self._said(node)).get(f"{section}.{key}")
        return "" if entry is None else str(entry.value).rpartition("::")[2]

    def values(self, node: str) -> dict[str, Any]:
        """Return all that the file says of a node, by the names that it uses."""
        self._nodes.add(node)
        return {name: entry.value for name, entry in self._said(node).items() if not entry.is_general}

    def wrong(self, node: str, name: str, why: str) -> None:
        """Note that a value cannot be."""
        entry = self._said(node).get(name)
        self._problems.append(Problem(f"{node}: {name} {why}", self.path, entry and entry.line))

    def ignored(self) -> list[str]:
        """Return one sentence per node that was not wholly understood.

        Raises:
            NavigationError: every value that cannot be, every name that is a likely typing mistake.
        """
        if self._problems:
            raise NavigationError(self._problems)
        return [
            f"{self.path.name}: {node} does not have {', '.join(what)}"
            for node, what in self._ignored.items()
        ]

    def finish(self, elsewhere: Collection[str] = ()) -> list[str]:
        """Return what `ignored` does, and which nodes of the file nobody read.

        Args:
            elsewhere: Nodes that are read on another occasion.

        Raises:
            NavigationError: as `ignored`.
        """
        told = self.ignored()
        others = sorted(s.node.strip("/") for s in self._sections if not s.is_pattern)
        read = self._nodes | set(elsewhere)
        absent = [name for name in others if self._without_namespace(name) not in read]
        return [*told, f"{self.path.name}: not read for {', '.join(absent)}"] if absent else told

    def _without_namespace(self, name: str) -> str:
        return name.removeprefix(self._namespace.strip("/") + "/") if self._namespace else name

    def _values(self, node: str, config: Any, names: Mapping[str, str], prefix: str) -> dict[str, _Value]:
        """Return the node's values by the names that this config has for them."""
        renamed = _by_axis(_renamed(self._said(node)))
        known = tuple(prefix + name for name in parameter_names(config, names))
        if "costmap" in node or node == "behavior_server":
            renamed = {_flat(name, known): entry for name, entry in renamed.items()}
        foreign = [name.removesuffix("plugin") for name in renamed if name.endswith(".plugin")]
        return self._without_foreign(node, renamed, config, names, prefix, foreign)

    def _said(self, node: str) -> dict[str, _Value]:
        """Return what the file says of a node."""
        found: dict[str, _Value] = {}
        for full in dict.fromkeys((f"/{node}", f"{self._namespace}/{node}")):
            for section in sorted(self._sections, key=lambda section: not section.is_pattern):
                if section.matches(full):
                    for said, value in section.values.items():
                        line = self._lines.get((section.node, said))
                        found[said] = _Value(value, said, line, section.is_pattern)
        return found

    def _without_foreign(
        self,
        node: str,
        values: dict[str, _Value],
        config: Any,
        names: Mapping[str, str],
        prefix: str,
        sections: list[str],
    ) -> dict[str, _Value]:
        """Leave out sections of plugins that are others than those here, and the lists of plugins."""
        classes = {prefix: config} if prefix else dict(_plugins(config, names))
        out = {name: entry for name, entry in values.items() if not name.endswith(_LISTS)}
        for section in sections:
            own, plugin = classes.get(section), str(values[section + "plugin"].value)
            if own is not None and not _is_same(plugin, own):
                self._ignored.setdefault(node, []).append(f"{plugin} ({section}*)")
                out = {name: entry for name, entry in out.items() if not name.startswith(section)}
        return out

    def _unknown(self, node: str, name: str, entry: _Value, known: tuple[str, ...]) -> None:
        section, _, last = name.rpartition(".")
        beside = [other.rpartition(".")[2] for other in known if other.rpartition(".")[0] == section]
        close = difflib.get_close_matches(last, beside, n=1, cutoff=_TYPO)
        sideways = bool(close) and last.replace("y", "x") == close[0].replace("y", "x")
        if close and not sideways and last not in _ONLY_NAV2S:
            said = f"{node} has no parameter {entry.said}; did you mean '{close[0]}'?"
            self._problems.append(Problem(said, self.path, entry.line))
        else:
            self._ignored.setdefault(node, []).append(entry.said)


def _plugins(config: Any, names: Mapping[str, str]) -> Iterator[tuple[str, Any]]:
    """Yield the sections of a config that are plugins, with their configs."""
    for field in fields(config):
        value = getattr(config, field.name)
        inside = value.items() if isinstance(value, Mapping) else [(names.get(field.name, field.name), value)]
        yield from ((f"{name}.", inner) for name, inner in inside if is_dataclass(inner))


def _renamed(values: dict[str, _Value]) -> dict[str, _Value]:
    """Give the sections of the first plugins the names that they have here."""
    new_names = {
        f"{values[key].value[0]}.": f"{name}."
        for key, name in _SECTIONS.items()
        if key in values and isinstance(values[key].value, list) and values[key].value
    }

    def renamed(name: str) -> str:
        for old, new in new_names.items():
            if name.startswith(old):
                return new + name.removeprefix(old)
        return name

    out = {renamed(name): entry for name, entry in values.items()}
    if "error_code_names" in out and isinstance(out["error_code_names"].value, list):
        entry = out.pop("error_code_names")
        prefixes = [str(name).removesuffix("_error_code") for name in entry.value]
        out["error_code_name_prefixes"] = entry._replace(value=prefixes)
    return out


def _by_axis(values: dict[str, _Value]) -> dict[str, _Value]:
    """Return the smoother's parameters with its lists [x, y, yaw] taken apart, as they are declared here."""
    out = dict(values)
    for said, name in (
        ("max_velocity", "max_velocity"),
        ("max_accel", "max_acceleration"),
        ("max_decel", "max_deceleration"),
    ):
        entry = out.get(said)
        if entry is None or not isinstance(entry.value, list) or len(entry.value) != 3:
            continue
        x, _, yaw = out.pop(said).value
        out[f"linear.{name}"] = entry._replace(value=abs(x))
        out[f"angular.{name}"] = entry._replace(value=abs(yaw))
    return out


def _flat(name: str, known: tuple[str, ...]) -> str:
    """Return a layer's or behaviour's parameter by its last part: here they share one set."""
    layer, last = name.partition(".")[0], name.rpartition(".")[2]
    if layer not in _LAYERS + _BEHAVIORS:
        return name
    return next((other for other in known if other.rpartition(".")[2] == last), name)


def _is_same(plugin: str, config: Any) -> bool:
    """Whether a plugin is of a config's kind, as RegulatedPurePursuitController is."""
    kind = type(config).__name__.removesuffix("Config").casefold()
    name = plugin.rpartition("::")[2]
    if kind == "docktype":
        return name in _DOCKS
    same = PLANNERS.get(name, "").replace("_", "").replace("smac", "")
    return kind in name.casefold() or kind in ("planner", same)


def _lines(path: Path) -> dict[tuple[str, str], int]:
    """Return the line of every value: (node, parameter) -> line."""
    root = yaml.compose(path.read_text("utf-8"), Loader=yaml.SafeLoader)
    return dict(_walk(root, "", None)) if root is not None else {}


def _walk(node: yaml.Node, name: str, parameter: str | None) -> Iterator[tuple[tuple[str, str], int]]:
    if not isinstance(node, yaml.MappingNode):
        return
    for key, value in node.value:
        text = str(key.value)
        if parameter is None and text == files.KEY:
            yield from _walk(value, name, "")
        elif parameter is None:
            yield from _walk(value, f"{name}/{text.strip('/')}", None)
        else:
            full = f"{parameter}.{text}" if parameter else text
            yield (name, full), key.start_mark.line + 1
            yield from _walk(value, name, full)
