"""Grid problems of MovingAI (Sturtevant 2012): `.map` and `.scen` texts, or both in one JSON."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.errors import MapError, Problem
from twin.files.reading import read_text

PASSABLE = ".GS"
"""Ground, grass and swamp; trees (T), water (W) and what is out of bounds (@, O) are not."""

FORMATS = "a MovingAI .map, .scen or .json, or a map_server .yaml"


@dataclass(frozen=True, kw_only=True)
class GridProblem:
    """From a cell to another; cells are (column, row), row 0 on top."""

    start: tuple[int, int]
    goal: tuple[int, int]
    optimal: float
    """Length of the shortest path: 8-connected, without cutting corners [cells]."""


@dataclass(frozen=True, kw_only=True)
class GridProblems:
    """A map and what to plan on it."""

    name: str
    free: NDArray[np.bool_]
    """Shape (h, w)."""
    problems: tuple[GridProblem, ...]


def read_grid_problems(path: Path) -> GridProblems:
    """Read a map and its problems: a .json, a .scen with its .map beside it, or a .map with its .scen.

    Raises:
        MapError: the file, or the other one, cannot be read or is not of this format.
    """
    if path.suffix == ".json":
        rows, problems = _read_json(path)
        return _checked(path, path.stem, _grid(rows, path), problems)
    if path.suffix == ".scen":
        map_name, problems = _read_scen(path)
        return _checked(path, path.name, _read_map(_beside(path, map_name)), problems)
    if path.suffix == ".map":
        scens = [path.with_name(path.name + ".scen"), path.with_suffix(".scen")]
        scen = next((file for file in scens if file.is_file()), None)
        if scen is None:
            raise MapError(
                Problem(f"no problems beside the map; valid is {scens[0].name} in its folder", path)
            )
        return _checked(scen, path.stem, _read_map(path), _read_scen(scen)[1])
    raise MapError(Problem(f"the file is no grid benchmark; valid is {FORMATS}", path))


def _text(path: Path) -> str:
    try:
        return read_text(path)
    except OSError as error:
        raise MapError(f"{path} cannot be read ({error.strerror}); valid is {FORMATS}") from error
    except UnicodeDecodeError as error:
        raise MapError(Problem(f"the file is not text; valid is {FORMATS}", path)) from error


def _read_json(path: Path) -> tuple[list[str], list[GridProblem]]:
    try:
        content: Any = json.loads(_text(path))
        rows, problems = content["rows"], content["problems"]
        return [str(row) for row in rows], [_problem(*problem) for problem in problems]
    except (ValueError, KeyError, TypeError, OverflowError) as error:
        what = '{"rows": ["..@"], "problems": [[start x, start y, goal x, goal y, optimal length]]}'
        raise MapError(Problem(f"the file is not MovingAI JSON; valid is {what}", path)) from error


def _read_map(path: Path) -> NDArray[np.bool_]:
    lines = _text(path).splitlines()
    head = next((i for i, line in enumerate(lines) if line.strip() == "map"), None)
    sizes = dict(line.split() for line in lines[:head] if len(line.split()) == 2) if head is not None else {}
    rows = [line.rstrip("\r\n") for line in lines[head + 1 :] if line.strip()] if head is not None else []
    if head is None or not rows:
        raise MapError(
            Problem("the file is no MovingAI map; valid is type, height, width, map and rows", path)
        )
    grid = _grid(rows, path)
    told = tuple(sizes.get(key, "") for key in ("height", "width"))
    if told != tuple(map(str, grid.shape)):
        message = (
            f"the header tells {told[0]} x {told[1]} cells, the rows have {grid.shape[0]} x {grid.shape[1]}"
        )
        raise MapError(Problem(f"{message}; valid is the same", path))
    return grid


def _grid(rows: list[str], path: Path) -> NDArray[np.bool_]:
    width = len(rows[0]) if rows else 0
    if width == 0:
        raise MapError(Problem("the map has no rows; valid is one at least", path))
    for number, row in enumerate(rows):
        if len(row) != width:
            message = f"row {number} has {len(row)} cells; valid is {width} as in row 0"
            raise MapError(Problem(message, path))
    return np.array([[cell in PASSABLE for cell in row] for row in rows])


def _read_scen(path: Path) -> tuple[str, list[GridProblem]]:
    problems, names = [], []
    for number, line in enumerate(_text(path).splitlines(), 1):
        fields = line.split()
        if not fields or fields[0] == "version":
            continue
        try:
            _bucket, name, _width, _height, *numbers = fields
            problems.append(_problem(*map(float, numbers)))
            names.append(name)
        except (ValueError, TypeError, OverflowError) as error:
            message = (
                "the line is no problem; valid is bucket, map, width, height, x, y, x, y, optimal length"
            )
            raise MapError(Problem(message, path, number)) from error
    if not problems:
        raise MapError(Problem("the file has no problems; valid is one at least", path))
    return names[0], problems


def _problem(sx: float, sy: float, gx: float, gy: float, optimal: float) -> GridProblem:
    return GridProblem(start=(int(sx), int(sy)), goal=(int(gx), int(gy)), optimal=float(optimal))


def _beside(scen: Path, map_name: str) -> Path:
    """Return the map of a .scen: as it names it, or by its name alone in the same folder."""
    tried = [scen.parent / map_name, scen.parent / Path(map_name).name, scen.with_suffix("")]
    return next((path for path in tried if path.suffix == ".map" and path.is_file()), tried[1])


def _checked(path: Path, name: str, free: NDArray[np.bool_], problems: list[GridProblem]) -> GridProblems:
    """Return the benchmark, or raise for the first problem that is none on this map."""
    height, width = free.shape
    for number, problem in enumerate(problems):
        for x, y in (problem.start, problem.goal):
            if not (0 <= x < width and 0 <= y < height and free[y, x]):
                message = (
                    f"problem {number} has ({x}, {y}), which is not free; valid is a free cell of the map"
                )
                raise MapError(Problem(message, path))
        if not (math.isfinite(problem.optimal) and problem.optimal >= 0.0):
            message = f"problem {number} has the length {problem.optimal}; valid is a finite number"
            raise MapError(Problem(message, path))
    return GridProblems(name=name, free=free, problems=tuple(problems))
