"""Behaviour trees that a Nav2 parameter file names, for the most part in packages of an installed ROS."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import PurePath
from typing import Any

from twin.errors import NavigationError
from twin.models.options import DEFAULTS
from twin.models.urdf.packages import PackagePath, Packages
from twin.nodes.navigation.behavior_trees.navigator import tree_file
from twin.nodes.navigation.bt_navigator_config import BtNavigatorConfig
from twin.parameters import NameOrPath
from twin.parameters.declaration import fields_of
from twin.runtime.parameter_files.nav2.file import Nav2Parameters

_SHARE = re.compile(r"\$\(\s*find-pkg-share\s+([^\s()]+)\s*\)")
_OWN = {
    "navigate_to_pose_w_replanning_and_recovery": "navigate_to_pose",
    "navigate_through_poses_w_replanning_and_recovery": "navigate_through_poses",
    "navigate_w_replanning_and_recovery": "navigate_to_pose",
}
"""Nav2's default trees, that of Foxy last, and those that ship here for the same."""


def with_trees(
    file: Nav2Parameters, config: BtNavigatorConfig, keep: frozenset[str]
) -> tuple[BtNavigatorConfig, list[str]]:
    """Return the navigator's config with trees that are here, and what was taken instead of what.

    Args:
        file: Notes trees that are nowhere.
        config: With the trees as the file names them.
        keep: Parameters that the scenario gives.
    """
    told, trees, said = [], dict[str, Any](), file.effective("bt_navigator")
    for name in (one.name for one in fields_of(config).values() if NameOrPath in one.markers):
        if name in keep or not isinstance(said.get(name), str):
            continue
        tree = _located(said[name], file)
        try:
            tree_file(tree)
        except NavigationError as fault:
            stem = PurePath(tree).stem
            own = _OWN.get(stem, stem)
            try:
                tree_file(own)
            except NavigationError:
                file.wrong("bt_navigator", name, f"cannot be used: {fault}")
                continue
            told.append(f"{file.path.name}: {name}: {said[name]} is not here; twin's own '{own}' is taken")
            tree = own
        trees[name] = tree
    return replace(config, **trees), told


def _located(text: str, file: Nav2Parameters) -> str:
    """Return a path: in the folders of packages that `$(find-pkg-share NAME)` finds, else beside the file."""
    packages = Packages(PackagePath.of(file.path, DEFAULTS))
    path = _SHARE.sub(lambda found: str(packages.get(found[1], found[0])), text)
    beside = file.path.parent / path
    return str(beside) if beside.is_file() else path
