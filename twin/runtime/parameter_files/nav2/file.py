"""A parameter file as Nav2 has it: names as the nodes here have them, lines, what became of each value."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any, TypeVar

from twin.bridge.parameters import files
from twin.errors import NavigationError, Problem, TwinError
from twin.navigation.costmaps.costmap_config import CostmapConfig
from twin.navigation.plugins import CRITICS
from twin.parameters.declaration import fields_of, names_of
from twin.parameters.placed import overlay, parameters_of
from twin.runtime.parameter_files.absent import Absent
from twin.runtime.parameter_files.lines import lines_of
from twin.runtime.parameter_files.nav2.names import (
    LISTS,
    Value,
    by_axis,
    class_of,
    converted,
    declared,
    flat,
    is_same,
    is_users,
    renamed,
)

C = TypeVar("C")

_TYPO = 0.85
"""As similar as this to a name that the node has, an unknown name is a mistake; else it is Nav2's alone."""
_ONLY_NAV2S = (
    "analytic_expansion_max_cost",
    "critics",
    "fine_xy_goal_tolerance",
    "max_angular_decel",
    "max_angular_vel",
    "simulation_step",
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
        self._lines = lines_of(path)
        self._problems: list[Problem] = []
        self._ignored: dict[str, list[str]] = {}
        self._idle: dict[str, list[str]] = {}
        self._absent: dict[str, Absent] = {}
        self._nodes: set[str] = set()
        self._understood: set[tuple[str, str]] = set()

    def applied(
        self,
        node: str,
        config: C,
        *,
        prefix: str = "",
        keep: frozenset[str] = frozenset(),
        rename: Callable[[str], str] = str,
        absent: Absent | None = None,
    ) -> C:
        """Return a node's config with the file's values.

        Args:
            node: Its name, such as 'controller_server' or 'local_costmap/local_costmap'.
            config: What holds without the file.
            prefix: Of all parameters of this config, such as 'GridBased.'.
            keep: Parameters, without their sections, that the scenario gives: they stay.
            rename: The file's name of a parameter -> the one here.
            absent: What the ROS node has beyond the one here.
        """
        self._nodes.add(node)
        self._absent[node] = absent or Absent()
        values = self._values(node, config, prefix, rename)
        known = tuple(prefix + name for name in parameters_of(config))
        taken = {
            name.removeprefix(prefix): entry.value
            for name, entry in values.items()
            if name in known and not keep & {name, *name.split(".")}
        }
        config, refused = overlay(config, taken)
        for name, why in refused.items():
            entry, why = values[prefix + name], why.removeprefix(f"{name} ")
            self._problems.append(Problem(_sentence(node, entry.said, why), self.path, entry.line))
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
        return names_of(CostmapConfig).robot_radius in said and "footprint" not in said

    def values(self, node: str) -> dict[str, Any]:
        """Return all that the file says of a node by its name, by the names that it uses."""
        self._nodes.add(node)
        return {name: entry.value for name, entry in self._said(node).items() if not entry.is_general}

    def effective(self, node: str) -> dict[str, Any]:
        """Return what holds for a node, what the file says of all nodes included."""
        return {name: entry.value for name, entry in self._said(node).items()}

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
        entry = renamed(self._said(node)).get(name)
        self._problems.append(Problem(f"{node}: {name} {why}", self.path, entry and entry.line))

    def ignored(self) -> list[str]:
        """Return one sentence per node that was not wholly understood.

        Raises:
            NavigationError: every value that cannot be, every name that is a likely typing mistake.
        """
        if self._problems:
            raise NavigationError(sorted(self._problems, key=lambda problem: problem.line or 0))
        nodes = dict.fromkeys((*self._ignored, *self._idle))
        return [f"{self.path.name}: {self._unread(node)}" for node in nodes]

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

    def nodes_with(self, pattern: str, usual: str) -> list[str]:
        """Return the robot's nodes of which the file gives a parameter that a pattern describes.

        Args:
            pattern: Regular expression of a parameter's whole name.
            usual: Alone, if it is among them, or if what is for all nodes has such a parameter.
        """

        def fits(names: Collection[str]) -> bool:
            return any(re.fullmatch(pattern, name) for name in names)

        named = [
            self._without_namespace(section.node.strip("/"))
            for section in self._sections
            if not section.is_pattern and fits(section.values)
        ]
        own = [name for name in dict.fromkeys(named) if "/" not in name or not self._namespace]
        return [usual] if usual in own or (not own and fits(self._said(usual))) else own

    def _unread(self, node: str) -> str:
        """Return the sentence about what was not read of a node."""
        missed, idle = (", ".join(what.get(node, ())) for what in (self._ignored, self._idle))
        if not missed:
            return f"{idle} of {node} would change nothing here"
        return f"{node} does not have {missed}" + (f"; {idle} would change nothing here" if idle else "")

    def _without_namespace(self, name: str) -> str:
        return name.removeprefix(self._namespace.strip("/") + "/") if self._namespace else name

    def _values(self, node: str, config: Any, prefix: str, rename: Callable[[str], str]) -> dict[str, Value]:
        """Return the node's values by the names that this config has for them."""
        values = converted(by_axis(renamed(self._said(node))))
        values = declared({rename(name): entry for name, entry in values.items()}, config, prefix)
        known = tuple(prefix + name for name in parameters_of(config))
        if "costmap" in node or node == "behavior_server":
            values = flat(values, known)
        return self._without_foreign(node, values, dict(_plugins(config)) if not prefix else {prefix: config})

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
        self, node: str, values: dict[str, Value], configs: Mapping[str, Any]
    ) -> dict[str, Value]:
        """Leave out sections of plugins that are others than those here, and the lists of plugins."""
        out = {name: entry for name, entry in values.items() if not name.endswith(LISTS)}
        for section in (name.removesuffix("plugin") for name in values if name.endswith(".plugin")):
            own, plugin = configs.get(section), str(values[section + "plugin"].value)
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
            listed = map(str, self._said(node)[entry.said].value)
            own = {critic.rpartition(":")[2] for critic in listed if is_users(CRITICS, critic)}
            valid = sorted({*there, *own, "Oscillation"})
            for critic in (one for one in entry.value if one not in valid):
                if close := _similar(critic, valid):
                    said = f"{node} has no critic '{critic}'; did you mean '{close[0]}'?"
                    self._problems.append(Problem(said, self.path, entry.line))
                else:
                    self._ignored.setdefault(node, []).append(f"the critic {critic}")

    def _tell(self, node: str, values: Mapping[str, Value], known: tuple[str, ...]) -> None:
        for name, entry in values.items():
            is_read = name in (*known, "use_sim_time") or (node, entry.said) in self._understood
            if not is_read and not entry.is_general:
                self._unknown(node, name, entry, known)

    def _unknown(self, node: str, name: str, entry: Value, known: tuple[str, ...]) -> None:
        section, _, last = name.rpartition(".")
        absent = self._absent.get(node, Absent())
        if last in absent:
            unread = self._idle if absent.makes_no_difference(last, entry.value) else self._ignored
            unread.setdefault(node, []).append(entry.said)
            return
        beside = [other.rpartition(".")[2] for other in known if other.rpartition(".")[0] == section]
        close = _similar(last, beside)
        sideways = bool(close) and last.replace("y", "x") == close[0].replace("y", "x")
        if close and not sideways and last not in _ONLY_NAV2S:
            whole = (
                f"{entry.said.removesuffix(last)}{close[0]}" if entry.said.endswith(f"_{last}") else close[0]
            )
            said = f"{node} has no parameter {entry.said}; did you mean '{whole}'?"
            self._problems.append(Problem(said, self.path, entry.line))
        else:
            self._ignored.setdefault(node, []).append(entry.said)


def _plugins(config: Any) -> Iterator[tuple[str, Any]]:
    """Yield the sections of a config that are plugins, with their configs."""
    for field, declaration in fields_of(config).items():
        value = getattr(config, field)
        inside = value.items() if isinstance(value, Mapping) else [(declaration.name, value)]
        yield from ((f"{name}.", inner) for name, inner in inside if is_dataclass(inner))


def _sentence(node: str, name: str, why: str) -> str:
    """Return why a value cannot be, with node and name told once."""
    if why.startswith(f"{node}: "):
        return why
    return f"{node}: {why[why.index(name) :]}" if name in why else f"{node}: {name} {why}"


def _similar(name: str, valid: Sequence[str]) -> list[str]:
    return difflib.get_close_matches(name, valid, n=1, cutoff=_TYPO)
