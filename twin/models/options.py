"""How a robot file is read: what its text may name, and what to do about what is missing or impossible."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from twin.plugins import Plugin


@dataclass(frozen=True, kw_only=True)
class ReadOptions:
    """Options of `load`; the defaults are strict and closed."""

    args: Mapping[str, str] = field(default_factory=dict)
    """Values of `<xacro:arg>`, as `name:=value` on a ROS command line."""
    packages: Mapping[str, Path] = field(default_factory=dict)
    """Folders of ROS packages that `$(find name)` and `package://name/` may name."""
    allow_env: tuple[str, ...] = ()
    """Environment variables that `$(env NAME)` and `$(optenv NAME)` may read."""
    allow_paths: tuple[Path, ...] = ()
    """Folders, beside that of the file and its packages, below which files may be read."""
    missing_mesh: Literal["error", "skip"] = "error"
    """`skip`: a shape whose mesh is missing or unreadable is left out, with a warning."""
    apply_up_axis: bool = True
    """Turn COLLADA meshes as their `<up_axis>` says, which RViz and Gazebo ignore."""
    sensors: tuple[Plugin[Any], ...] = ()
    """Sensors of a user, beside those that ship; they are executed."""
    execute: bool = False
    """Whether sensors of installed packages are executed; else a robot is read without them."""
    repair: bool = False
    """Take the nearest physical inertia for a moving part whose own is impossible, with a warning."""


DEFAULTS = ReadOptions()
