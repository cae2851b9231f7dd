"""One of Nav2's parameter files: names as the nodes here have them, lines, and what became of each value."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel

from twin.bridge.parameters import files
from twin.errors import NavigationError, Problem, TwinError
from twin.nodes.node_parameters import overlay, parameter_names
from twin.runtime.nav2_checks import why_not, wrong_critics
from twin.runtime.nav2_names import (
    LISTS,
    Value,
    by_axis,
    class_of,
    converted,
    flat,
    is_same,
    local_name,
    renamed,
)

C = TypeVar("C")

_TYPO = 0.85
"""As similar as this to a name that the node has, an unknown name is a mistake; else it is Nav2's alone."""
_ONLY_NAV2S = (
    "analytic_expansion_max_cost",
    "critics",
    "external_detection_rotation_pitch",
    "external_detection_rotation_roll",
    "fine_xy_goal_tolerance",
    "max_angular_decel",
    "max_angular_vel",
    "max_linear_accel",
    "transform_tolerance",
    "yaw_goal_tolerance",
)
"""Names of Nav2 that only look like mistakes."""


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
        self._understood: set[tuple[str, str]] = set()

    def applied(
        self,
        node: str,
        config: C,
        names: Mapping[str, str] | None = None,
        *,
        prefix: str = "",
        keep: frozenset[str] = frozenset(),
        limits: type[BaseModel] | None = None,
    ) -> C:
        """Return a node's config with the file's values.

        Args:
            node: Its name, such as 'controller_server' or 'local_costmap/local_costmap'.
            config: What holds without the file.
            names: Field -> parameter, as for `declare_config`.
            prefix: Of all parameters of this config, such as 'GridBased.'.
            keep: Parameters, without their sections, that the scenario gives: they stay.
            limits: What a scenario may give of them.
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
        if limits is not None:
            impossible = {name: why_not(limits, local_name(name), value) for name, value in taken.items()}
            refused = {**{name: why for name, why in impossible.items() if why}, **refused}
        for name, why in refused.items():
            entry = values[prefix + name]
            said = why if why.startswith(f"{node}: ") else f"{node}: {entry.said} {why}"
            self._problems.append(Problem(said, self.path, entry.line))
        self._check_critics(node, values, known)
        self._tell(node, values, known)
        return config

    def plugin(self, node: str, section: str, key: str = "plugin") -> str:
        """Return the class of a plugin, without its package; '' if the file does not tell."""
        entry = renamed(self._said(node)).get(f"{section}.{key}")
        return "" if entry is None else class_of(entry.value)

    def is_round(self, node: str) -> bool:
        """Whether a costmap of the file has a radius, and no polygon that would go before it."""
        said = converted(self._said(node))
        return "robot_radius" in said and "footprint" not in said

    def values(self, node: str) -> dict[str, Any]:
        """Return all that the file says of a node, by the names that it uses."""
        self._nodes.add(node)
        return {name: entry.value for name, entry in self._said(node).items() if not entry.is_general}

    def relative(self, topic: str) -> str:
        """Return a topic's name in the robot's namespace."""
        for before in (f"{self._namespace}/", "<robot_namespace>/", "/"):
            topic = topic.removeprefix(before)
        return topic

    def understood(self, node: str, *names: str) -> None:
        """Note parameters that were read by `values`: nothing needs to be told of them."""
        self._understood.update((node, name) for name in names)

    def others(self, node: str, known: tuple[str, ...]) -> None:
        """Tell what the file says of a node beside what is known."""
        self._tell(node, self._said(node), known)

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

    def _values(self, node: str, config: Any, names: Mapping[str, str], prefix: str) -> dict[str, Value]:
        """Return the node's values by the names that this config has for them."""
        values = converted(by_axis(renamed(self._said(node))))
        known = tuple(prefix + name for name in parameter_names(config, names))
        if "costmap" in node or node == "behavior_server":
            values = flat(values, known)
        foreign = [name.removesuffix("plugin") for name in values if name.endswith(".plugin")]
        return self._without_foreign(node, values, config, names, prefix, foreign)

    def _said(self, node: str) -> dict[str, Value]:
        """Return what the file says of a node."""
        found: dict[str, Value] = {}
        for full in dict.fromkeys((f"/{node}", f"{self._namespace}/{node}")):
            for section in sorted(self._sections, key=lambda section: not section.is_pattern):
                if section.matches(full):
                    for said, value in section.values.items():
                        line = self._lines.get((section.node, said))
                        found[said] = Value(value, said, line, section.is_pattern)
        return found

    def _without_foreign(
        self,
        node: str,
        values: dict[str, Value],
        config: Any,
        names: Mapping[str, str],
        prefix: str,
        sections: list[str],
    ) -> dict[str, Value]:
        """Leave out sections of plugins that are others than those here, and the lists of plugins."""
        classes = {prefix: config} if prefix else dict(_plugins(config, names))
        out = {name: entry for name, entry in values.items() if not name.endswith(LISTS)}
        for section in sections:
            own, plugin = classes.get(section), str(values[section + "plugin"].value)
            if own is not None and not is_same(plugin, own):
                self._ignored.setdefault(node, []).append(f"{plugin} ({section}*)")
                out = {name: entry for name, entry in out.items() if not name.startswith(section)}
        return out

    def _check_critics(self, node: str, values: Mapping[str, Value], known: tuple[str, ...]) -> None:
        for name, entry in values.items():
            section = name.removesuffix("critics")
            if name not in known or section == name or not isinstance(entry.value, list):
                continue
            there = {other.removeprefix(section).partition(".")[0] for other in known if "." in other}
            mistakes, absent = wrong_critics(entry.value, sorted({*there, "Oscillation"}))
            self._problems += [Problem(f"{node} {said}", self.path, entry.line) for said in mistakes]
            for critic in absent:
                self._ignored.setdefault(node, []).append(f"the critic {critic}")

    def _tell(self, node: str, values: Mapping[str, Value], known: tuple[str, ...]) -> None:
        for name, entry in values.items():
            is_read = name in (*known, "use_sim_time") or (node, entry.said) in self._understood
            if not is_read and not entry.is_general:
                self._unknown(node, name, entry, known)

    def _unknown(self, node: str, name: str, entry: Value, known: tuple[str, ...]) -> None:
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
