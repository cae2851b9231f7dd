"""Whatever number stands in a scenario: it is read, or refused in a sentence with its place."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from twin.errors import Problem, ScenarioError
from twin.scenario.schema import Scenario, json_schema, load
from twin.strict_yaml.document import Document, Loc, apply_override
from twin.strict_yaml.explain import validate

_EXTREME = ("1e308", "1e-320", "1e400", "-0.0", "-1e15", "1e15", "1e-15", "1e-100", "nan", "9" * 5000)
_WITH_UNIT = ("1e308 {}", "1e-320 {}", "-1e400 {}", "1e9 {}", "1e-9 {}", "0 {}", "1e999999999 {}")

_BASE: dict[str, Any] = {
    "name": "a",
    "duration": 1,
    "world": {"arena": "warehouse"},
    "robots": [{"model": "diff_bot", "name": "a", "localisation": {"type": "amcl"}, "navigation": {}}],
    "mission": {"type": "idle"},
    "checks": [{"energy": {"max": 1}}],
}


_schema = cache(json_schema)


def _resolved(node: dict[str, Any]) -> dict[str, Any]:
    return _schema()["$defs"][node["$ref"].rpartition("/")[2]] if "$ref" in node else node


def _least(node: dict[str, Any]) -> Any:
    """The smallest value that a schema node allows."""
    node = _resolved(node)
    for key in ("const", "default"):
        if node.get(key) is not None:
            return deepcopy(node[key])
    for key in ("anyOf", "oneOf"):
        if key in node:
            return _least(node[key][0])
    if "enum" in node:
        return node["enum"][0]
    kind = node.get("type")
    if kind == "object":
        keys = node.get("required", list(node["properties"])[:1] if node.get("minProperties") else [])
        return {key: _least(node["properties"][key]) for key in keys}
    if kind == "array":
        if "prefixItems" in node:
            return [_least(item) for item in node["prefixItems"]]
        return [_least(node["items"]) for _ in range(node.get("minItems", 0))]
    return {"string": "a", "boolean": True}.get(str(kind), 1)


def _numbers(
    node: dict[str, Any], loc: Loc, above: tuple[str, ...], data: Any
) -> Iterator[tuple[Loc, dict[str, Any], str]]:
    """Yield the place of every number below a node, a document that has the place, and the number's unit."""
    name = node.get("$ref", "")
    if name in above:
        return
    node, above = _resolved(node), (*above, name) if name else above
    choices = [*node.get("anyOf", []), *node.get("oneOf", [])]
    units = [choice["pattern"] for choice in choices if "pattern" in choice]
    if units:
        yield loc, data, units[0].rpartition("(")[2].partition("|")[0].rstrip(")$")
    elif node.get("type") in ("number", "integer"):
        yield loc, data, ""
    else:
        for choice in choices:
            yield from _numbers(choice, loc, above, _with(data, loc, _least(choice)))
    one_of = node.get("minProperties")
    for key, child in node.get("properties", {}).items():
        if "const" in _resolved(child):
            continue
        inner = _with(data, loc, {}) if one_of else data
        here = _get(inner, loc)
        if here is None or key not in here:
            inner = _with(inner, (*loc, key), _least(child))
        yield from _numbers(child, (*loc, key), above, inner)
    items = node.get("prefixItems") or ([node["items"]] if isinstance(node.get("items"), dict) else [])
    for index, child in enumerate(items):
        here = _get(data, loc) or []
        filled = here if len(here) > index else [_least(each) for each in items]
        yield from _numbers(child, (*loc, index), above, _with(data, loc, filled))
    if isinstance(node.get("additionalProperties"), dict):
        child = node["additionalProperties"]
        yield from _numbers(child, (*loc, "a"), above, _with(data, loc, {"a": _least(child)}))


def _get(data: Any, loc: Loc) -> Any:
    for part in loc:
        try:
            data = data[part]
        except (KeyError, IndexError, TypeError):
            return None
    return data


def _with(data: Any, loc: Loc, value: Any) -> Any:
    if not loc:
        return value
    copy = (dict if isinstance(loc[0], str) else list)(data or ())
    if isinstance(copy, list):
        copy[loc[0]] = _with(copy[loc[0]], loc[1:], value)
    else:
        copy[loc[0]] = _with(copy.get(loc[0]), loc[1:], value)
    return copy


def _validated(data: dict[str, Any], loc: Loc, text: str) -> tuple[bool, list[Problem]]:
    """As `load` does it, without the file: a hundred times faster."""
    document = Document(Path("a.yaml"), deepcopy(data))
    apply_override(document, ".".join(map(str, loc)), text)
    return validate(Scenario, document) is not None and not document.problems, document.problems


def test_every_number_of_the_schema_is_read_or_refused_in_a_sentence() -> None:
    places = list(_numbers(_schema(), (), (), _BASE))
    assert len(places) > 300
    for number, (loc, data, unit) in enumerate(places):
        texts = [*_EXTREME, *(text.format(unit) for text in _WITH_UNIT if unit)]
        for text in texts[number % 8 :: 8]:  # each kind of place is there many times
            accepted, problems = _validated(data, loc, text)
            assert accepted or problems, (loc, text)
    some = places[::8]
    sound = sum(
        any(_validated(data, loc, text)[0] for text in ("1", "0.5", "2", "20")) for loc, data, _ in some
    )
    assert sound > 0.5 * len(some)  # or nothing would be compared with other fields


def test_the_sentence_names_place_and_valid_sizes(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    rest = "robots: [{model: diff_bot, command_latency: 1e-320}]\nchecks: [{energy: {max: 1}}]\n"
    path.write_text(f"name: a\nduration: 1e308\nseed: 123456789012345678901\n{rest}", encoding="utf-8")
    with pytest.raises(ScenarioError) as fault:
        load(path, {"recording.poses_hz": "1e-120"})
    in_size = "must be 0, or a number from 1e-100 to 1e+15 in size"
    assert [str(problem) for problem in fault.value.problems] == [
        f"{path}:2: duration: {in_size}, not 1e308",
        f"{path}:3: seed: must be at most 20 digits, not 123456789012345678901",
        f"{path}:4: robots.0.command_latency: {in_size}, not 1e-320",
        f"override recording.poses_hz=1e-120: recording.poses_hz: {in_size}, not 1e-120",
    ]
    path.write_text(
        "name: a\nduration: 1e10\nrobots: [{model: diff_bot}]\nchecks: [{energy: {max: 1}}]\n", "utf-8"
    )
    with pytest.raises(ScenarioError) as fault:
        load(path, {"physics.timestep": "1e999999999 ms"})
    in_size = "must be 0, or from 1e-09 to 1e+09 s in size"
    assert [str(problem) for problem in fault.value.problems] == [
        f"{path}:2: duration: {in_size}, not 10000000000.0",
        f"override physics.timestep=1e999999999 ms: physics.timestep: {in_size}, not '1e999999999 ms'",
    ]
