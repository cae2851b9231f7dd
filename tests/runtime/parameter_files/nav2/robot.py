"""A robot whose navigation takes a Nav2 parameter file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from twin.models.specs import DriveSpec
from twin.navigation.costmaps.footprint import rectangle
from twin.nodes.navigation.robot_pose import Frames
from twin.runtime.defaults.navigation import NavigationParameters, navigation_parameters
from twin.runtime.parameter_files.nav2.parameters import with_file, with_plugins
from twin.scenario.navigation import NavigationConfig


def applied(
    tmp_path: Path, text: str, config: dict[str, Any] | None = None, namespace: str = ""
) -> tuple[NavigationParameters, list[str]]:
    """Return the parameters with a file of this text, and what of it was not understood."""
    file = tmp_path / "nav2.yaml"
    file.write_text(text)
    scenario = NavigationConfig.model_validate({"params_file": str(file), **(config or {})})
    drive = DriveSpec(
        kind="diff_drive",
        left_joints=("left",),
        right_joints=("right",),
        wheel_separation=0.3,
        wheel_radius=0.05,
    )
    scenario = with_plugins(scenario, namespace)
    before = navigation_parameters(scenario, drive, rectangle(0.3, 0.3), Frames())
    return with_file(before, scenario, namespace)
