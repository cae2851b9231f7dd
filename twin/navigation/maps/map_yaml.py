"""The YAML file of a map, read with every fault and its line."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import yaml

from twin.errors import MapError, Problem
from twin.files.reading import read_text, refusal
from twin.geometry import Pose2

Mode = Literal["trinary", "scale", "raw"]

REQUIRED = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")
MODES: tuple[Mode, ...] = get_args(Mode)


@dataclass(frozen=True, kw_only=True)
class MapMetadata:
    """The keys of a map_server YAML file."""

    image: Path
    resolution: float
    origin: Pose2
    negate: bool
    occupied_thresh: float
    free_thresh: float
    mode: Mode


def read_metadata(path: Path) -> MapMetadata:
    """Read and check a map_server YAML file.

    Raises:
        MapError: with every fault found, each with its line.
    """
    return _MetadataReader(path).read()


class _MetadataReader:
    """Reads one file, collecting problems on the way."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.values: dict[str, Any] = {}
        self.lines: dict[str, int] = {}
        self.problems: list[Problem] = []

    def read(self) -> MapMetadata:
        self._parse()
        for key in REQUIRED:
            if key not in self.values:
                close = difflib.get_close_matches(key, self.values, n=1, cutoff=0.7)
                hint = f"; did you mean it by '{close[0]}'?" if close else ""
                self._report(f"the key '{key}' is missing{hint}", close[0] if close else None)
        self.values.setdefault("mode", "trinary")
        readers = {"image": self._image, **_READERS}
        found = {key: self._get(key, convert) for key, convert in readers.items()}
        occupied, free = found["occupied_thresh"], found["free_thresh"]
        if occupied is not None and free is not None and free > occupied:
            message = f"is {free}; valid is at most occupied_thresh ({occupied})"
            self._report(message, "free_thresh", name=True)
        if self.problems:
            raise MapError(self.problems)
        return MapMetadata(**found)

    def _parse(self) -> None:
        try:
            text = read_text(self.path)
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
            raise MapError(f"map file {self.path} cannot be read ({reason}); valid is a YAML file") from error
        try:
            root = yaml.compose(text, Loader=yaml.SafeLoader)
            values = yaml.safe_load(text)
        except (yaml.YAMLError, ValueError) as error:
            mark = getattr(error, "problem_mark", None)
            reason = getattr(error, "problem", None) or str(error)
            line = mark.line + 1 if mark else None
            raise MapError(Problem(f"the file is not YAML: {reason}", self.path, line)) from error
        if not isinstance(root, yaml.MappingNode):
            message = f"the file holds no keys; valid keys: {', '.join(REQUIRED)}"
            raise MapError(Problem(message, self.path, 1))
        for key_node, _ in root.value:
            key, line = str(key_node.value), key_node.start_mark.line + 1
            if key in self.lines:
                first = self.lines[key]
                message = f"the key '{key}' is given twice (first in line {first}); valid is once"
                self.problems.append(Problem(message, self.path, line))
            self.lines.setdefault(key, line)
        self.values = {str(key): value for key, value in values.items()}

    def _get(self, key: str, convert: Callable[[Any], Any]) -> Any:
        if key not in self.values:
            return None
        try:
            return convert(self.values[key])
        except ValueError as error:
            self._report(str(error), key, name=True)
            return None

    def _image(self, value: Any) -> Path:
        if not isinstance(value, str) or not value:
            raise ValueError(f"is {value!r}; valid is the name of an image file")
        image = self.path.parent / Path(value).expanduser()
        if not image.is_file():
            raise ValueError(f"names {image}: {refusal(image) or 'it is not there'}; valid is an image file")
        return image

    def _report(self, message: str, key: str | None = None, *, name: bool = False) -> None:
        text = f"{key} {message}" if name else message
        self.problems.append(Problem(text, self.path, self.lines.get(key or "")))


def _number(
    value: Any, *, above: float = -math.inf, at_least: float = -math.inf, at_most: float = math.inf
) -> float:
    valid = f"a number above {above:g}" if above > -math.inf else "a number"
    valid = f"a number from {at_least:g} to {at_most:g}" if at_most < math.inf else valid
    try:
        number = float(value)  # also YAML 1.1's strings such as 5e-2
    except (TypeError, ValueError):
        raise ValueError(f"is {value!r}; valid is {valid}") from None
    in_range = math.isfinite(number) and number > above and at_least <= number <= at_most
    if isinstance(value, bool) or not in_range:
        raise ValueError(f"is {value!r}; valid is {valid}")
    return number


def _origin(value: Any) -> Pose2:
    if not isinstance(value, list) or len(value) != 3:
        raise ValueError(f"is {value!r}; valid is [x, y, yaw]")
    return Pose2(*(_number(part) for part in value))


def _flag(value: Any) -> bool:
    if isinstance(value, bool | int):
        return bool(value)
    raise ValueError(f"is {value!r}; valid is 0 or 1")


def _mode(value: Any) -> str:
    if value not in MODES:
        raise ValueError(f"is {value!r}; valid is one of {', '.join(MODES)}")
    return str(value)


def _share(value: Any) -> float:
    return _number(value, at_least=0.0, at_most=1.0)


_READERS: dict[str, Callable[[Any], Any]] = {
    "resolution": lambda value: _number(value, above=0.0),
    "origin": _origin,
    "negate": _flag,
    "occupied_thresh": _share,
    "free_thresh": _share,
    "mode": _mode,
}
