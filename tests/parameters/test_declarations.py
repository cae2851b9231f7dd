"""What a field declares holds wherever its value comes from, and stands nowhere else."""

from __future__ import annotations

import ast
import dataclasses
import importlib
import math
import pkgutil
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import twin
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.errors import BridgeError, NavigationError, ScenarioError
from twin.nodes.node_parameters import declare_config
from twin.parameters.declaration import Declaration, fields_of
from twin.parameters.placed import parameters_of
from twin.runtime.parameter_files.nav2.file import Nav2Parameters
from twin.scenario.parameter_group import ParameterGroup, group_of
from twin.strict_yaml import load

PACKAGE = Path(twin.__file__).parent


@cache
def _configs() -> tuple[type, ...]:
    """Every dataclass with a field that has a unit or a bound."""
    modules = [
        importlib.import_module(module.name)
        for package in ("controllers", "navigation", "nodes")
        for module in pkgutil.walk_packages([str(PACKAGE / package)], f"twin.{package}.")
    ]
    classes = [
        value
        for module in modules
        for value in vars(module).values()
        if isinstance(value, type) and value.__module__ == module.__name__
    ]
    return tuple(one for one in classes if dataclasses.is_dataclass(one) and _is_declared(one))


def _is_declared(config: type) -> bool:
    try:
        fields = fields_of(config)
    except NameError:
        return False  # of the program, not of parameters: its types are for type checkers only
    domains = [one.domain for one in fields.values() if one.domain is not None]
    return any(domain.unit is not None or domain.bounds.said for domain in domains)


def _outside(declaration: Declaration) -> Iterator[float]:
    """Yield numbers just outside of a parameter's bounds."""
    domain = declaration.domain
    assert domain is not None
    whole = domain.kind is int
    for edge, side in ((domain.bounds.least, -1), (domain.bounds.most, 1)):
        if edge is not None and abs(edge) < 1e18:
            yield int(edge) + side if whole else edge + side * max(1e-3, abs(edge) * 1e-3)


def _bounded(config: type) -> Iterator[Declaration]:
    for declaration in fields_of(config).values():
        domain = declaration.domain
        if domain is not None and domain.kind in (int, float) and domain.bounds.said:
            yield declaration


def _instance(config: type) -> Any:
    required = {
        field: _of(declaration) for field, declaration in fields_of(config).items() if declaration.is_required
    }
    return config(**required)


def _of(declaration: Declaration) -> Any:
    domain = declaration.domain
    if domain is None:
        assert declaration.config is not None, declaration
        return _instance(declaration.config)
    if domain.item is not None:
        return (True,) * 15 if domain.item.kind is bool else ("a",)
    if domain.choices:
        return domain.choices[0]
    return {str: "a", bool: True, int: 1}.get(domain.kind, 1.0)


@pytest.fixture(scope="module")
def bus() -> Iterator[Bus]:
    with Bus.open(Clock()) as opened:
        yield opened


@pytest.mark.parametrize(
    "config", [one for one in _configs() if list(_bounded(one))], ids=lambda one: one.__name__
)
def test_a_number_out_of_bounds_is_refused_from_every_side_with_the_bound(
    config: type, bus: Bus, tmp_path: Path
) -> None:
    wrong = {(one.name, value): one for one in _bounded(config) for value in _outside(one)}
    example, group = _instance(config), group_of(config)
    node = bus.create_node(config.__name__)
    declare_config(node, example, lambda changed: None)
    for (name, value), declaration in wrong.items():
        assert declaration.domain is not None
        bound = declaration.domain.bounds.said
        # A scenario
        if name in group.model_fields:
            file = tmp_path / "scenario.yaml"
            file.write_text(f"{name}: {value}\n")
            with pytest.raises(ScenarioError) as of_scenario:
                load(file, group, error=ScenarioError)
            assert of_scenario.value.problems[0].line == 1
            assert f"{name}: must be {bound}, not " in of_scenario.value.problems[0].message
        if name not in parameters_of(example):
            continue  # None in this one: no parameter
        # A live set
        with pytest.raises(BridgeError) as of_set:
            node.set_parameter(name, value)
        assert f"{name} must be {bound}, not {value!r}" in str(of_set.value)
        # A parameter file
        if declaration.nav2:
            continue  # Nav2 has other values, too
        file = tmp_path / "params.yaml"
        file.write_text(f"some_node:\n  ros__parameters:\n    {name}: {value}\n")
        nav2 = Nav2Parameters(file)
        nav2.applied("some_node", example)
        with pytest.raises(NavigationError) as of_file:
            nav2.finish()
        (problem,) = of_file.value.problems
        assert (problem.line, problem.message) == (3, f"some_node: {name} must be {bound}, not {value!r}")


@pytest.mark.parametrize("config", _configs(), ids=lambda one: one.__name__)
def test_what_no_number_is_and_what_is_no_number_is_refused(config: type) -> None:
    for declaration in fields_of(config).values():
        domain = declaration.domain
        if domain is None or domain.kind is not float:
            continue
        values: list[Any] = [
            math.nan,
            "1.0",
            True,
            *([] if domain.may_be_infinite else [math.inf, -math.inf, 1e300]),
        ]
        for value in values:
            with pytest.raises(ValueError, match="must be "):
                domain.checked(value)


@pytest.mark.parametrize("config", _configs(), ids=lambda one: one.__name__)
def test_defaults_are_valid_and_texts_are_told(config: type) -> None:
    example = _instance(config)
    for field, declaration in fields_of(config).items():
        if declaration.domain is None or declaration.is_required:
            continue
        told = declaration.tell(getattr(example, field))
        assert declaration.tell(declaration.read(told)) == told, field
        assert declaration.text, f"{config.__name__}.{field} has no text"


def _groups(group: type[ParameterGroup] = ParameterGroup) -> Iterator[type[ParameterGroup]]:
    for one in group.__subclasses__():
        yield one
        yield from _groups(one)


def test_no_group_repeats_a_field_of_its_config() -> None:
    made = [one for one in _groups() if one.configs]
    assert len(made) > 20
    for group in made:
        declared = [one for config in group.configs for one in fields_of(config).values()]
        keys = {one.name for one in declared if one.domain is not None}
        written = {key for base in group.__mro__ for key in _body(base)}
        assert not keys & written, f"{group.__name__} repeats {sorted(keys & written)}"


@cache
def _bodies(module: str) -> dict[str, set[str]]:
    tree = ast.parse(Path(str(importlib.import_module(module).__file__)).read_text("utf-8"))
    return {
        node.name: {
            item.target.id
            for item in node.body
            if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name)
        }
        for node in tree.body
        if isinstance(node, ast.ClassDef)
    }


def _body(kind: type) -> set[str]:
    """Return the fields that are written in a class of the scenario's schema."""
    return (
        _bodies(kind.__module__).get(kind.__name__, set())
        if kind.__module__.startswith("twin.scenario")
        else set()
    )


OTHERS = {
    "publish_frequency": "of robot_state_publisher, which is no config",
    "set_initial_pose": "a service",
    "smooth_path": "an action",
    "sigma_hit": "what diagnostics call a measured value",
    "transform_timeout": "of robot_localization, which nothing here has",
    "transform_tolerance": "of Nav2's nodes that have none here",
    "yaw_goal_tolerance": "of Nav2's nodes that have none here",
    "map_frame": "of slam_toolbox, whose frames are the robot's",
    "odom_frame": "of slam_toolbox, whose frames are the robot's",
    "base_frame": "of slam_toolbox, whose frames are the robot's",
    "closed_loop": "a check",
    "wheel_radius": "a fault",
    "use_imu": "a key of a scenario's localisation",
}
"""Names that are something else, too."""


def test_no_name_of_a_parameter_stands_outside_of_its_declaration() -> None:
    names = {
        name
        for config in _configs()
        for declaration in fields_of(config).values()
        if declaration.domain is not None
        for name in (declaration.field, declaration.name)
        if "_" in name and not name.startswith("period")
    }
    found = {}
    for folder in ("navigation", "controllers", "nodes", "runtime", "scenario"):
        for path in sorted((PACKAGE / folder).rglob("*.py")):
            if "behavior_trees" in path.parts:
                continue  # the ports of a tree's nodes have names of their own
            tree = ast.parse(path.read_text("utf-8"))
            told = {
                id(part)
                for node in ast.walk(tree)
                if isinstance(node, ast.AnnAssign)
                for part in ast.walk(node.annotation)
            }
            for node in ast.walk(tree):
                if isinstance(node, ast.Constant) and node.value in names and id(node) not in told:
                    found[f"{path.relative_to(PACKAGE)}:{node.lineno} {node.value}"] = node.value
    assert not {place: name for place, name in found.items() if name not in OTHERS}
    assert set(found.values()) >= set(OTHERS), "an exception that is none any more"


def test_reading_a_scenario_loads_no_kernels_and_no_messages() -> None:
    heavy = "('numba', 'rosbags', 'mujoco', 'zenoh')"
    code = f"import sys, twin.scenario.schema; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
