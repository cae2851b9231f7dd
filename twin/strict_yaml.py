"""Read a YAML file into a pydantic model and report every fault of the file at once, each with its line.

YAML is read with the core schema of YAML 1.2 (so `1e-3` is a number, `on` and `no` are text). Physical values
are SI numbers or text with a unit: `duration: 240` and `duration: 4 min` are the same.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationError
from pydantic_core import CoreSchema, PydanticCustomError, core_schema, to_json

from twin.errors import Problem, TwinError, nearest

Loc = tuple[str | int, ...]
M = TypeVar("M", bound=BaseModel)

_MAX_NODES = 100_000
"""More values than any file we read has; stops a file whose aliases multiply without end."""


class StrictModel(BaseModel):
    """Base of every file schema: unknown keys are errors, values are frozen, docstrings describe."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True, str_min_length=1
    )


class Fault(NamedTuple):
    """A fault between fields, found after every single field is valid."""

    loc: Loc
    """Keys and indices from the model that raises to the value at fault."""
    message: str
    """What is wrong and what would be valid."""


class Faults(ValueError):
    """Raised by a model's own validator; `load` gives each fault its file and line."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__("; ".join(f"{'.'.join(map(str, f.loc))}: {f.message}" for f in self.faults))


# -- units -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Unit:
    """Metadata of an `Annotated[float, Unit(...)]` that accepts an SI number or text with a unit."""

    quantity: str
    factors: tuple[tuple[str, str | float], ...]
    """Unit and its size in SI (exact text, or a float for irrational ones); the SI unit comes first."""

    def parse(self, value: object) -> float:
        """Return `value` in SI; raises PydanticCustomError naming the valid units."""
        if isinstance(value, int | float) and not isinstance(value, bool):
            return float(value)
        match = _QUANTITY.fullmatch(value) if isinstance(value, str) else None
        names = ", ".join(name for name, _ in self.factors)
        si = self.factors[0][0]
        if match is None or not match[2]:
            raise PydanticCustomError(
                "unit",
                "must be a number ({q} in {si}) or text with a unit ({n})",
                {"q": self.quantity, "si": si, "n": names},
            )
        factor = dict(self.factors).get(match[2])
        if factor is None:
            raise PydanticCustomError(
                "unit",
                "has the unit '{u}', valid for {q} are {n}",
                {"u": match[2], "q": self.quantity, "n": names},
            )
        number = Fraction(match[1])
        return float(number) * factor if isinstance(factor, float) else float(number * Fraction(factor))

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.parse, handler(source))

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        names = "|".join(re.escape(name) for name, _ in self.factors)
        text = {"type": "string", "pattern": rf"^[-+]?[0-9.]+([eE][-+]?[0-9]+)?\s*({names})$"}
        return {"anyOf": [handler(core), text]}


_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S*)\s*")
_DEG = math.pi / 180.0

Seconds = Annotated[
    float, Unit("time", (("s", "1"), ("ms", "1/1000"), ("us", "1/1000000"), ("min", "60"), ("h", "3600")))
]
Metres = Annotated[float, Unit("length", (("m", "1"), ("cm", "1/100"), ("mm", "1/1000"), ("km", "1000")))]
Radians = Annotated[float, Unit("angle", (("rad", "1"), ("deg", _DEG), ("°", _DEG)))]
Kilograms = Annotated[float, Unit("mass", (("kg", "1"), ("g", "1/1000"), ("t", "1000")))]
MetresPerSecond = Annotated[
    float, Unit("speed", (("m/s", "1"), ("cm/s", "1/100"), ("mm/s", "1/1000"), ("km/h", "5/18")))
]
RadiansPerSecond = Annotated[
    float, Unit("turn rate", (("rad/s", "1"), ("deg/s", _DEG), ("°/s", _DEG), ("rpm", math.pi / 30.0)))
]
Newtons = Annotated[float, Unit("force", (("N", "1"), ("mN", "1/1000"), ("kN", "1000")))]
Hertz = Annotated[float, Unit("frequency", (("Hz", "1"), ("kHz", "1000")))]
Joules = Annotated[float, Unit("energy", (("J", "1"), ("kJ", "1000"), ("Wh", "3600"), ("kWh", "3600000")))]


# -- YAML to plain data with lines -----------------------------------------------------------------------


class _CoreLoader(yaml.SafeLoader):
    """PyYAML's composer with the scalar rules of YAML 1.2's core schema."""

    yaml_implicit_resolvers: dict[str, Any] = {}  # noqa: RUF012  (PyYAML's own attribute)


for _tag, _pattern in (
    ("null", r"~|null|Null|NULL|"),
    ("bool", r"true|True|TRUE|false|False|FALSE"),
    ("int", r"[-+]?[0-9]+|0x[0-9a-fA-F]+|0o[0-7]+"),
    ("float", r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?"),
):
    _CoreLoader.add_implicit_resolver(f"tag:yaml.org,2002:{_tag}", re.compile(rf"(?:{_pattern})\Z"), None)


@dataclass
class _Document:
    """Plain data of a file, where each value came from, and what is wrong with the YAML itself."""

    file: Path
    data: Any = None
    lines: dict[Loc, int] = field(default_factory=dict)
    overrides: dict[Loc, str] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)

    def problem(self, loc: Loc, message: str) -> Problem:
        """Place a message: at the override that set the value, else at the innermost known line."""
        for end in range(len(loc), -1, -1):
            if loc[:end] in self.overrides:
                return Problem(f"override {self.overrides[loc[:end]]}: {message}")
            if loc[:end] in self.lines:
                return Problem(message, self.file, self.lines[loc[:end]])
        return Problem(message, self.file, 1)


def _scalar(node: yaml.ScalarNode) -> Any:
    kind = node.tag.rpartition(":")[2]
    if kind == "null":
        return None
    if kind == "bool":
        return node.value.lower() == "true"
    if kind == "int":
        return int(node.value, 10 if node.value[:2] not in ("0x", "0o") else 0)
    return float(node.value) if kind == "float" else node.value


def _construct(document: _Document, node: yaml.Node, loc: Loc, above: tuple[int, ...]) -> Any:
    """Turn a composed node into plain data, noting lines, duplicate keys and endless aliases."""
    document.lines.setdefault(loc, node.start_mark.line + 1)
    if id(node) in above or len(document.lines) > _MAX_NODES:
        document.problems.append(
            document.problem(loc, "alias contains itself or grows without end; write the value out")
        )
        return None
    if isinstance(node, yaml.ScalarNode):
        return _scalar(node)
    above = (*above, id(node))
    if isinstance(node, yaml.SequenceNode):
        return [_construct(document, item, (*loc, i), above) for i, item in enumerate(node.value)]
    data: dict[str, Any] = {}
    for key_node, value_node in node.value:
        key = key_node.value if isinstance(key_node, yaml.ScalarNode) else None
        line = key_node.start_mark.line + 1
        if key is None:
            document.problems.append(Problem("a key must be text", document.file, line))
        elif key in data:
            first = document.lines[(*loc, key)]
            message = f"duplicate key '{key}'{_within(loc)}, first given in line {first}; keep one of them"
            document.problems.append(Problem(message, document.file, line))
        else:
            document.lines[(*loc, key)] = line
            data[key] = _construct(document, value_node, (*loc, key), above)
    return data


def _compose(text: str) -> yaml.Node | None:
    loader = _CoreLoader(text)
    try:
        return loader.get_single_node()
    finally:
        loader.dispose()


def _yaml_message(fault: yaml.YAMLError) -> str:
    """Return PyYAML's complaint as one sentence."""
    parts = [getattr(fault, "context", None), getattr(fault, "problem", None)]
    return f"invalid YAML: {', '.join(part for part in parts if part) or fault}"


def _read(path: Path, error: type[TwinError]) -> _Document:
    document = _Document(path)
    try:
        node = _compose(path.read_text(encoding="utf-8"))
    except OSError as fault:
        raise error(Problem(f"cannot read the file: {fault.strerror}", path)) from None
    except UnicodeDecodeError as fault:
        raise error(
            Problem(f"not UTF-8 text: byte {fault.start} is {fault.object[fault.start]:#x}", path)
        ) from None
    except yaml.YAMLError as fault:
        mark = getattr(fault, "problem_mark", None)
        raise error(Problem(_yaml_message(fault), path, None if mark is None else mark.line + 1)) from None
    if node is None:
        raise error(Problem("the file is empty", path, 1))
    document.data = _construct(document, node, (), ())
    document.lines[()] = 1
    return document


def _override(document: _Document, dotted: str, text: str) -> None:
    """Set one value; whether its keys exist is the schema's business, indices must exist here."""
    name = f"{dotted}={text}"
    try:
        node = _compose(text)
    except yaml.YAMLError as fault:
        document.problems.append(Problem(f"override {name}: {_yaml_message(fault)}"))
        return
    keys: list[str | int] = []
    target: Any = document.data
    parts = dotted.split(".")
    for i, part in enumerate(parts):
        last = i == len(parts) - 1
        if isinstance(target, list):
            if not part.isdecimal() or int(part) >= len(target):
                valid = f"indices 0 to {len(target) - 1}" if target else "none, the list is empty"
                document.problems.append(
                    Problem(f"override {name}: no item '{part}'{_within(tuple(keys))}; valid: {valid}")
                )
                return
            keys.append(int(part))
        elif isinstance(target, dict):
            keys.append(part)
        else:
            here = ".".join(map(str, keys)) or "the file"
            message = f"override {name}: {here} is {_shown(target)} and has no key '{part}'"
            document.problems.append(Problem(message))
            return
        if last:
            document.overrides[tuple(keys)] = name
            target[keys[-1]] = None if node is None else _construct(_Document(document.file), node, (), ())
        else:
            if isinstance(target, dict) and target.get(part) is None:
                target[part] = {}
                document.overrides[tuple(keys)] = name
            target = target[keys[-1]]


# -- pydantic's errors in the user's words ---------------------------------------------------------------

_WORDS = MappingProxyType(
    {
        "float_type": "must be a number",
        "float_parsing": "must be a number",
        "int_type": "must be a whole number",
        "int_from_float": "must be a whole number",
        "bool_type": "must be true or false",
        "string_type": "must be text",
        "string_too_short": "must not be empty",
        "list_type": "must be a list",
        "tuple_type": "must be a list",
        "dict_type": "must be a mapping (key: value)",
        "model_type": "must be a mapping (key: value)",
        "greater_than": "must be greater than {gt}",
        "greater_than_equal": "must be at least {ge}",
        "less_than": "must be less than {lt}",
        "less_than_equal": "must be at most {le}",
    }
)


def _within(loc: Loc) -> str:
    return f" in {'.'.join(map(str, loc))}" if loc else ""


def _shown(value: object) -> str:
    text = repr(value) if not isinstance(value, dict | list) else to_json(value).decode()
    return text if len(text) <= 60 else text[:57] + "..."


def _data_loc(data: Any, loc: Loc) -> Loc:
    """Drop the union tags that pydantic puts into a location; keep a last key that the data lacks."""
    kept: list[str | int] = []
    for part in loc:
        inside = (
            part in data
            if isinstance(data, dict)
            else isinstance(data, list) and isinstance(part, int) and part < len(data)
        )
        if inside:
            kept.append(part)
            data = data[part]
    return tuple(kept)


def _valid_keys(schema: type[BaseModel], loc: Loc) -> list[str]:
    """Return the keys that the schema allows at a location, found in its JSON schema."""
    root = schema.model_json_schema()
    nodes = _expand(root, root)
    for part in loc:
        step: list[dict[str, Any]] = []
        for node in nodes:
            mapping = node.get("discriminator", {}).get("mapping", {})
            child = {"$ref": mapping[part]} if part in mapping else node.get("properties", {}).get(part)
            child = node.get("items") if isinstance(part, int) else child or node.get("additionalProperties")
            step += _expand(child, root) if isinstance(child, dict) else []
        nodes = step
    return sorted({key for node in nodes for key in node.get("properties", {})})


def _expand(node: dict[str, Any], root: dict[str, Any]) -> list[dict[str, Any]]:
    """Follow references and alternatives of a JSON schema node."""
    if "$ref" in node:
        return _expand(root["$defs"][node["$ref"].rpartition("/")[2]], root)
    alternatives = node.get("anyOf", [])
    return [node, *(found for alternative in alternatives for found in _expand(alternative, root))]


def _explain(
    schema: type[BaseModel], document: _Document, fault: Mapping[str, Any]
) -> Iterator[tuple[Loc, str]]:
    """Yield place and sentence of one pydantic error."""
    kind, loc, context = fault["type"], tuple(fault["loc"]), fault.get("ctx", {})
    at = _data_loc(document.data, loc)
    name = ".".join(map(str, at)) or "the file"
    if kind == "extra_forbidden":
        hint = nearest(str(loc[-1]), _valid_keys(schema, loc[:-1]))
        yield at, f"unknown key '{loc[-1]}'{_within(at[:-1])}; {hint}"
    elif kind == "missing":
        yield (*at, loc[-1]), f"missing key '{loc[-1]}'{_within(at)}"
    elif kind == "union_tag_not_found":
        key = context["discriminator"].strip("'")
        yield (*at, key), f"missing key '{key}'{_within(at)}"
    elif kind in ("union_tag_invalid", "literal_error"):
        word = str(context.get("tag", fault["input"]))
        valid = re.findall(r"'([^']*)'", context.get("expected_tags") or context["expected"])
        key = context["discriminator"].strip("'") if "discriminator" in context else None
        where = at if key is None else (*at, key)
        yield where, f"{'.'.join(map(str, where))}: unknown value '{word}'; {nearest(word, valid)}"
    elif isinstance(context.get("error"), Faults):
        for inner in context["error"].faults:
            yield (*at, *inner.loc), inner.message
    elif isinstance(context.get("error"), ValueError):
        yield at, f"{name}: {context['error']}"
    else:
        words = _WORDS.get(kind, fault["msg"][:1].lower() + fault["msg"][1:]).format(**context)
        yield at, f"{name}: {words}, not {_shown(fault['input'])}"


def _without(data: Any, locs: Sequence[Loc]) -> Any:
    """Return a deep copy of plain data without the values at some locations."""

    def copy(value: Any, loc: Loc) -> Any:
        if isinstance(value, dict):
            return {k: copy(v, (*loc, k)) for k, v in value.items() if (*loc, k) not in gone}
        if isinstance(value, list):
            return [copy(v, (*loc, i)) for i, v in enumerate(value)]
        return value

    gone = set(locs)
    return copy(data, ())


def _validate(schema: type[M], document: _Document) -> M | None:
    """Validate, adding every fault to the document; a second pass finds faults behind the first ones."""
    found: dict[tuple[Loc, str], None] = {}
    data = document.data
    for _ in range(2):
        try:
            model = schema.model_validate_json(to_json(data), strict=True)
        except ValidationError as invalid:
            faults = [dict(fault) for fault in invalid.errors()]
        else:
            if not found:
                return model
            break
        bad = {loc for loc, _ in found}
        explained = [item for fault in faults for item in _explain(schema, document, fault)]
        found |= {(loc, text): None for loc, text in explained if loc not in bad}
        data = _without(document.data, [loc for loc, _ in found])
    document.problems += [document.problem(loc, text) for loc, text in found]
    return None


def load(
    path: Path,
    schema: type[M],
    *,
    error: type[TwinError],
    overrides: Mapping[str, str] = MappingProxyType({}),
) -> M:
    """Read a YAML file into `schema`.

    Args:
        path: The file.
        schema: A pydantic model, best a `StrictModel`; its validators may raise `Faults`.
        error: What to raise.
        overrides: Dotted path to YAML text, e.g. `{"robots.0.pose.yaw": "90 deg"}`.

    Raises:
        TwinError: As `error`, with every problem of the file and of the overrides, in file order.
    """
    document = _read(path, error)
    for dotted, text in overrides.items():
        _override(document, dotted, text)
    model = _validate(schema, document)
    if model is None or document.problems:
        raise error(sorted(document.problems, key=lambda p: (p.line is None, p.line or 0)))
    return model
