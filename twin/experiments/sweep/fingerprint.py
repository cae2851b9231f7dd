"""What a run is made of, as a hash: runs with equal ones give the same result."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from twin.files.kept import hash_of
from twin.models import ReadOptions
from twin.models import load as load_robot
from twin.models.shapes import Mesh
from twin.scenario.schema import Scenario

_IRRELEVANT = {"seed", "description", "pass_rate", "recording"}
"""Keys that change no message of a run; the seed is told beside."""


def scenario_fingerprint(scenario: Scenario, file_hash: Callable[[str], str | None] | None = None) -> str:
    """Return the SHA-256 of a scenario without its seed, the same wherever its files lie.

    Instead of the paths of files their contents count: a robot's text after xacro and its meshes, what an
    arena, a map, a parameter file, a tree or a plugin's file says.

    Args:
        scenario: As it was loaded.
        file_hash: Of a path's content, if it was asked for before.

    Raises:
        ModelError: A robot cannot be read.
    """
    content = file_hash or hash_of
    told = _without_places(scenario.model_dump(mode="json", exclude=_IRRELEVANT), content)
    robots = [
        _robot(robot.model, tuple(sorted(robot.args.items())), tuple(scenario.sensors))
        for robot in scenario.robots
    ]
    return hashlib.sha256(json.dumps([told, robots], sort_keys=True).encode()).hexdigest()


@lru_cache(maxsize=64)
def _robot(model: str, args: tuple[tuple[str, str], ...], sensors: tuple[str, ...]) -> list[str | None]:
    from twin.models.sensors import SENSORS

    types = tuple(map(SENSORS.find, sensors))
    robot = load_robot(model, ReadOptions(args=dict(args), sensors=types, execute=True))
    meshes = {
        str(shape.geometry.path)
        for link in robot.links.values()
        for shape in link.shapes
        if isinstance(shape.geometry, Mesh)
    }
    text = hashlib.sha256(robot.urdf.encode()).hexdigest()
    return [text, *sorted(str(hash_of(mesh)) for mesh in meshes)]


def _without_places(value: Any, content: Callable[[str], str | None]) -> Any:
    if isinstance(value, Mapping):
        return {key: _without_places(item, content) for key, item in value.items()}
    if isinstance(value, list):
        return [_without_places(item, content) for item in value]
    if isinstance(value, str):
        return next(_of_files(value, content), value)
    return value


def _of_files(text: str, content: Callable[[str], str | None]) -> Iterator[str]:
    """Yield a text with the hash of the file that it names instead of the name, if it names one."""
    file, colon, name = text.rpartition(":") if ".py:" in text else (text, "", "")
    if ("/" in file or "." in file) and Path(file).is_file():
        yield f"{content(file)}{colon}{name}"
