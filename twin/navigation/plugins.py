"""What of navigation can come from a user's package or file; what ships is registered in the same way.

A plugin is found by its parameters: their class is the plugin's `Config`. That of a user's plugin is derived
from what he wrote, and so knows whose it is, also where two plugins share their parameters.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from twin.navigation.control.dwb.config import DWBConfig
from twin.navigation.control.goal_checker import (
    GoalCheckerConfig,
    PositionGoalCheckerConfig,
    StoppedGoalCheckerConfig,
)
from twin.navigation.control.mppi.config import MPPIConfig
from twin.navigation.control.progress_checker import PoseProgressCheckerConfig, ProgressCheckerConfig
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
from twin.navigation.control.rotation_shim_config import RotationShimConfig
from twin.navigation.planning.config import (
    HybridConfig,
    PlannerConfig,
    SavitzkyGolayConfig,
    SmootherConfig,
    ThetaStarConfig,
)
from twin.plugins import Kind, Plugin, require_finite

if TYPE_CHECKING:
    from twin.navigation.behavior_trees.node import TreeNode
    from twin.navigation.control.controller import Controller
    from twin.navigation.control.critic import Critic, Trajectories
    from twin.navigation.control.goal_checker import GoalChecker
    from twin.navigation.control.progress_checker import ProgressChecker
    from twin.navigation.costmaps.layer import Layer
    from twin.navigation.planning.planner import GlobalPlanner
    from twin.navigation.planning.smoother import Smoother

T = TypeVar("T")


def _kind(name: str, base: str, group: str) -> Kind[Any]:
    return Kind(name, base=f"twin.navigation.{base}", group=f"twin.{group}")


CONTROLLERS: Kind[Controller] = _kind("controller", "control.controller:Controller", "controllers")
CRITICS: Kind[Critic] = _kind("critic", "control.critic:Critic", "critics")
"""Of MPPI and DWB, beside those that are compiled into them."""
GOAL_CHECKERS: Kind[GoalChecker] = _kind("goal checker", "control.goal_checker:GoalChecker", "goal_checkers")
PROGRESS_CHECKERS: Kind[ProgressChecker] = _kind(
    "progress checker", "control.progress_checker:ProgressChecker", "progress_checkers"
)
PLANNERS: Kind[GlobalPlanner] = _kind("planner", "planning.planner:GlobalPlanner", "planners")
SMOOTHERS: Kind[Smoother] = _kind("smoother", "planning.smoother:Smoother", "smoothers")
LAYERS: Kind[Layer] = _kind("layer", "costmaps.layer:Layer", "layers")
"""Of costmaps, beside those that ship: `costmap_config.LAYERS`."""
TREE_NODES: Kind[TreeNode] = _kind("behaviour tree node", "behavior_trees.node:TreeNode", "bt_nodes")
"""Beside those of BehaviorTree.CPP and Nav2."""
_CONFIGS: dict[tuple[str, str], type] = {}
"""Of what ships, by kind and name."""


def _ship(kind: Kind[Any], name: str, target: str, config: type) -> None:
    """Register what ships, with its parameters: to know those, nothing is compiled."""
    kind.register(name, target)
    _CONFIGS[kind.name, name] = config


_CONTROL, _PLANNING = "twin.navigation.control", "twin.navigation.planning"
_PURSUIT = f"{_CONTROL}.regulated_pure_pursuit.controller:RegulatedPurePursuit"
_ship(CONTROLLERS, "regulated_pure_pursuit", _PURSUIT, RegulatedPurePursuitConfig)
_ship(CONTROLLERS, "dwb", f"{_CONTROL}.dwb.controller:DWB", DWBConfig)
_ship(CONTROLLERS, "mppi", f"{_CONTROL}.mppi.controller:MPPI", MPPIConfig)
_ship(CONTROLLERS, "rotation_shim", f"{_CONTROL}.rotation_shim:RotationShim", RotationShimConfig)
_ship(GOAL_CHECKERS, "simple", f"{_CONTROL}.goal_checker:SimpleGoalChecker", GoalCheckerConfig)
_ship(GOAL_CHECKERS, "stopped", f"{_CONTROL}.goal_checker:StoppedGoalChecker", StoppedGoalCheckerConfig)
_ship(GOAL_CHECKERS, "position", f"{_CONTROL}.goal_checker:PositionGoalChecker", PositionGoalCheckerConfig)
_PROGRESS = f"{_CONTROL}.progress_checker"
_ship(PROGRESS_CHECKERS, "simple", f"{_PROGRESS}:SimpleProgressChecker", ProgressCheckerConfig)
_ship(PROGRESS_CHECKERS, "pose", f"{_PROGRESS}:PoseProgressChecker", PoseProgressCheckerConfig)
_ship(PLANNERS, "grid_based", f"{_PLANNING}.planner:Planner", PlannerConfig)
_ship(PLANNERS, "theta_star", f"{_PLANNING}.planner:ThetaStar", ThetaStarConfig)
_ship(PLANNERS, "smac_hybrid", f"{_PLANNING}.hybrid:HybridPlanner", HybridConfig)
_ship(SMOOTHERS, "simple_smoother", f"{_PLANNING}.smoother:SimpleSmoother", SmootherConfig)
_ship(SMOOTHERS, "savitzky_golay", f"{_PLANNING}.smoother:SavitzkyGolaySmoother", SavitzkyGolayConfig)


@dataclass(frozen=True)
class NoParameters:
    """Those of a plugin that has none."""


def config_of(plugin: Plugin[Any]) -> type:
    """Return the class of a plugin's parameters, by which `create` finds it."""
    if plugin.ships:
        return _CONFIGS[plugin.kind.name, plugin.name]
    loaded: Any = plugin.load()
    return _bound(plugin, loaded)


def configs_of(kind: Kind[Any]) -> dict[str, type]:
    """Return the classes of parameters of what ships, by name."""
    return {name: _CONFIGS[kind.name, name] for name in kind.shipped}


@functools.cache
def _bound(plugin: Plugin[Any], loaded: Any) -> type:
    """Return the class of a user's plugin's parameters, for the class as it was loaded."""
    written = getattr(loaded, "Config", None) or NoParameters
    return type(written.__name__, (written,), {"plugin": plugin, "__module__": written.__module__})


def bound(plugin: Plugin[Any], config: Any) -> Any:
    """Return parameters as an object by which `create` finds the plugin; None: there are none."""
    kind = config_of(plugin)
    if config is not None and not is_dataclass(config):
        raise plugin.error("has a Config that is no dataclass")
    given = () if config is None else (field.name for field in fields(config) if field.init)
    return kind(**{name: getattr(config, name) for name in given})


def plugin_of(kind: Kind[T], config: Any) -> Plugin[T]:
    """Return the plugin that parameters are of."""
    found: Plugin[T] | None = getattr(config, "plugin", None)
    if found is not None:
        return found
    return kind.find(next(name for name, of in configs_of(kind).items() if of is type(config)))


def create(kind: Kind[T], config: Any, **setup: Any) -> T:
    """Return the object that parameters are of, made with further arguments.

    Raises:
        PluginError: a user's plugin cannot be made; also later, when it answers nonsense.
    """
    plugin = plugin_of(kind, config)
    made: Callable[..., T] = checked(plugin)
    with plugin.guard:
        return made(config=config, **setup)


def checked(plugin: Plugin[T]) -> type[T]:
    """Return a plugin's class; of a user's one that looks at what its methods answer."""
    loaded = plugin.load()
    if plugin.ships:
        return loaded
    base = next(cls for cls in loaded.__mro__ if f"{cls.__module__}:{cls.__name__}" == plugin.kind.base)
    members: dict[str, Any] = {
        name: _answering(plugin, getattr(loaded, name), *answer)
        for name, answer in _ANSWERS.items()
        if hasattr(base, name)
    }

    def begin(self: Any, *args: Any, **kwargs: Any) -> None:
        loaded.__init__(self, *args, **kwargs)
        if vars(self).keys().isdisjoint(_OF_EVERY_BASE):
            raise plugin.error("does not call super().__init__ with what it is made with")

    members["__init__"] = begin
    return type(loaded.__name__, (loaded,), {**members, "__module__": loaded.__module__})


def _answering(
    plugin: Plugin[Any], method: Callable[..., Any], answer: Callable[..., Any], valid: str
) -> Any:
    @functools.wraps(method)
    def call(self: Any, *args: Any, **kwargs: Any) -> Any:
        said = method(self, *args, **kwargs)
        try:
            return answer(plugin, said, *args)
        except (TypeError, ValueError, AttributeError):
            shown = f"answers {method.__name__} with {' '.join(repr(said).split()):.60}"
            raise plugin.error(f"{shown}; it must return {valid}") from None

    return call


def _command(plugin: Plugin[Any], answer: Any, *_: Any) -> tuple[float, float]:
    v, w = map(float, answer)
    require_finite(plugin, "a command", (v, w))
    return v, w


def _path(plugin: Plugin[Any], answer: Any, *_: Any) -> np.ndarray:
    path = np.array(answer, dtype=np.float64, order="C")
    if path.ndim != 2 or path.shape[1] != 3 or not len(path):
        raise ValueError
    require_finite(plugin, "a path", path[~np.isfinite(path).all(axis=1)].ravel())
    return path


def own_critics(config: Any) -> list[Critic]:
    """Return the critics of MPPI's or DWB's parameters that a user brings, and that score."""
    names = [name for name in config.critics if name in config.own_critics]
    return [create(CRITICS, config.own_critics[name]) for name in names]


def _truth(plugin: Plugin[Any], answer: Any, *_: Any) -> bool:
    if not isinstance(answer, bool | np.bool_):
        raise TypeError
    return bool(answer)


def _score(plugin: Plugin[Any], answer: Any, trajectories: Trajectories) -> np.ndarray:
    score = np.array(answer, dtype=np.float64)
    if score.shape != trajectories.poses.shape[:1]:
        raise ValueError
    require_finite(plugin, "a score", score[~np.isfinite(score)])
    return score


def _status(plugin: Plugin[Any], answer: Any, *_: Any) -> Any:
    if getattr(answer, "name", None) not in _STATUSES:
        raise TypeError
    return answer


def _window(plugin: Plugin[Any], answer: Any, *_: Any) -> Any:
    corners = [operator.index(getattr(answer, name)) for name in ("x0", "y0", "x1", "y1")]
    return type(answer)(*corners)


_OF_EVERY_BASE = ("config", "status")
"""One of these is made by the constructor of what a plugin is derived from."""
_STATUSES = ("RUNNING", "SUCCESS", "FAILURE", "SKIPPED")
_A_PATH = (_path, "a path of shape (n, 3): x, y [m], yaw [rad]")
_A_TRUTH = (_truth, "True or False")
_ANSWERS: Mapping[str, tuple[Callable[..., Any], str]] = MappingProxyType(
    {
        "compute_velocity_commands": (_command, "(v [m/s], w [rad/s])"),
        "score": (_score, "one number per trajectory: an array of shape (n,)"),
        "create_plan": _A_PATH,
        "smooth": _A_PATH,
        "is_goal_reached": _A_TRUTH,
        "check": _A_TRUTH,
        "update_bounds": (_window, "a Window(x0, y0, x1, y1) of cells"),
        "tick": (_status, f"Status.{', Status.'.join(_STATUSES)}"),
    }
)
"""What methods must return: what reads an answer, and raises a ValueError; the same in words."""
