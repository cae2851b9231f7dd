"""Scenarios by name: those of the project in the current folder, and those that ship with twin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from twin.errors import ScenarioError, nearest
from twin.files.shipped import beside

FOLDER = Path("scenarios")
"""Where a project keeps its scenarios."""


@dataclass(frozen=True)
class Summary:
    """What a listing says of a scenario."""

    robots: tuple[str, ...]
    """Their models, as the file names them."""
    arena: str
    """As the file names it; empty for none."""
    description: str


def catalogue() -> Mapping[str, Path]:
    """Return the scenario files by name, the project's own first: they hide shipped ones of their names."""
    return {**_named(beside("scenarios")), **_named(FOLDER)}


def resolve(name_or_path: str | Path) -> Path:
    """Return the file that a name or path means; what is wrong with a path is said by who reads it.

    Raises:
        ScenarioError: It is neither a path nor the name of a scenario.
    """
    text, path = str(name_or_path), Path(name_or_path)
    if path.is_file():
        return path
    known = catalogue()
    if text in known:
        return known[text]
    if path.suffix in (".yaml", ".yml") or len(path.parts) > 1 or path.exists():
        return path
    raise ScenarioError(f"no scenario '{text}': {nearest(text, known)}, or the path of a scenario file")


def summary(file: Path) -> Summary | None:
    """Return what a file says of itself, None if it is no scenario; what it names is not looked at.

    Raises:
        ScenarioError: It cannot be read.
    """
    from twin.strict_yaml.document import read

    data = read(file, ScenarioError).data
    robots = data.get("robots") if isinstance(data, dict) else None
    if not isinstance(robots, list):
        return None
    world = data.get("world")
    return Summary(
        robots=tuple(str(robot.get("model")) for robot in robots if isinstance(robot, dict)),
        arena=str(world.get("arena") or "") if isinstance(world, dict) else "",
        description=str(data.get("description") or ""),
    )


def _named(folder: Path) -> dict[str, Path]:
    """Return the scenarios of a folder and of those in it, by their paths without `.yaml`."""
    files = sorted(folder.rglob("*.yaml"), key=lambda file: (len(file.parts), file))
    return {file.relative_to(folder).with_suffix("").as_posix(): file for file in files}
