"""Every controller and checker by its config: what Nav2 finds by the name of a plugin."""

from __future__ import annotations

from twin.geometry import Array
from twin.navigation.control.controller import Controller
from twin.navigation.control.dwb.config import DWBConfig
from twin.navigation.control.dwb.controller import DWB
from twin.navigation.control.goal_checker import (
    GoalChecker,
    GoalCheckerConfig,
    PositionGoalChecker,
    PositionGoalCheckerConfig,
    SimpleGoalChecker,
    StoppedGoalChecker,
    StoppedGoalCheckerConfig,
)
from twin.navigation.control.mppi.config import MPPIConfig
from twin.navigation.control.mppi.controller import MPPI
from twin.navigation.control.progress_checker import (
    PoseProgressChecker,
    PoseProgressCheckerConfig,
    ProgressChecker,
    ProgressCheckerConfig,
    SimpleProgressChecker,
)
from twin.navigation.control.regulated_pure_pursuit.controller import RegulatedPurePursuit
from twin.navigation.control.rotation_shim import RotationShim
from twin.navigation.control.rotation_shim_config import ControllerConfig, RotationShimConfig


def create_controller(config: ControllerConfig, footprint: Array) -> Controller:
    """Return the controller that a config is of, for a footprint of shape (n, 2) [m]."""
    if isinstance(config, RotationShimConfig):
        primary = create_controller(config.primary_controller, footprint)
        return RotationShim(config=config, primary=primary, footprint=footprint)
    if isinstance(config, MPPIConfig):
        return MPPI(config=config, footprint=footprint)
    if isinstance(config, DWBConfig):
        return DWB(config=config, footprint=footprint)
    return RegulatedPurePursuit(config=config, footprint=footprint)


def create_goal_checker(config: PositionGoalCheckerConfig) -> GoalChecker:
    """Return the goal checker that a config is of."""
    if isinstance(config, StoppedGoalCheckerConfig):
        return StoppedGoalChecker(config=config)
    if isinstance(config, GoalCheckerConfig):
        return SimpleGoalChecker(config=config)
    return PositionGoalChecker(config=config)


def create_progress_checker(config: ProgressCheckerConfig) -> ProgressChecker:
    """Return the progress checker that a config is of."""
    if isinstance(config, PoseProgressCheckerConfig):
        return PoseProgressChecker(config=config)
    return SimpleProgressChecker(config=config)
