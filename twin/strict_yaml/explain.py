"""Pydantic's errors as sentences with a place in the file; found in two passes.

The second sees the data with misspellings corrected, and finds what they hid: Pydantic compares fields with
each other only once each is valid on its own, so one misspelt key would hide every fault of that sort. Only
misspellings are corrected: a guess at a wrong number could make up a fault.
"""

from __future__ import annotations

import copy
import difflib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import to_json

from twin.errors import nearest
from twin.strict_yaml.document import Document, Loc, shown, within


class Fault(NamedTuple):
    """A fault between fields, found after every single field is valid."""

    loc: Loc
    """Keys and indices from the model that raises to the value at fault."""
    message: str
    """What is wrong and what would be valid."""
    valid: tuple[str, ...] = ()
    """Of an unknown key, instead of a message: the names that are valid."""


class Faults(ValueError):
    """Raised by a model's own validator; `load` gives each fault its file and line."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__("; ".join(f"{'.'.join(map(str, f.loc))}: {f.message}" for f in self.faults))


class Finding(NamedTuple):
    """One fault in the data of a file."""

    loc: Loc
    """Where: of a key that is missing, where it should be."""
    message: str
    kind: Literal["unknown key", "unknown value", "missing key", "other"] = "other"
    meant: str | None = None
    """The key or value that was probably meant."""


_SURE = 0.75
"""So alike is `sise` to `size`; what is less, such as `duration` to `duplication`, may have been another."""
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
        "too_short": "must have at least {min_length} items",
        "too_long": "must have at most {max_length} items",
        "greater_than": "must be greater than {gt}",
        "greater_than_equal": "must be at least {ge}",
        "less_than": "must be less than {lt}",
        "less_than_equal": "must be at most {le}",
    }
)


def _data_loc(data: Any, loc: Loc) -> Loc:
    """Drop the union tags that pydantic puts into a location; keep a last key that the data lacks."""
    kept: list[str | int] = []
    for part in loc:
        in_list = isinstance(data, list) and isinstance(part, int) and part < len(data)
        if in_list or (isinstance(data, dict) and part in data):
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


def explain(schema: type[BaseModel], data: Any, fault: Mapping[str, Any]) -> Iterator[Finding]:
    """Yield what one pydantic error about `data` means; one error may stand for several faults."""
    kind, loc, context = fault["type"], tuple(fault["loc"]), fault.get("ctx", {})
    at = _data_loc(data, loc)
    name = ".".join(map(str, at)) or "the file"
    if kind == "extra_forbidden":
        yield _unknown(at, str(loc[-1]), _valid_keys(schema, loc[:-1]))
    elif kind == "missing" and isinstance(loc[-1], int):
        yield Finding(at, f"{name}: must have at least {loc[-1] + 1} items")
    elif kind in ("missing", "union_tag_not_found"):
        key = context["discriminator"].strip("'") if "discriminator" in context else loc[-1]
        yield Finding((*at, key), f"missing key '{key}'{within(at)}", "missing key")
    elif kind in ("union_tag_invalid", "literal_error"):
        word = str(context.get("tag", fault["input"]))
        valid = re.findall(r"'([^']*)'", context.get("expected_tags") or context["expected"])
        where = (*at, context["discriminator"].strip("'")) if "discriminator" in context else at
        text = f"{'.'.join(map(str, where))}: unknown value '{word}'; {nearest(word, valid)}"
        yield Finding(where, text, "unknown value", _closest(word, valid))
    elif isinstance(context.get("error"), Faults):
        for inner in context["error"].faults:
            place = (*at, *inner.loc)
            known = not inner.valid
            yield Finding(place, inner.message) if known else _unknown(place, str(place[-1]), inner.valid)
    elif isinstance(context.get("error"), ValueError):
        yield Finding(at, f"{name}: {context['error']}, not {shown(fault['input'])}")
    else:
        words = _WORDS.get(kind, fault["msg"][:1].lower() + fault["msg"][1:]).format(**context)
        yield Finding(at, f"{name}: {words}, not {shown(fault['input'])}")


def _unknown(at: Loc, key: str, valid: Sequence[str]) -> Finding:
    text = f"unknown key '{key}'{within(at[:-1])}; {nearest(key, valid)}"
    return Finding(at, text, "unknown key", _closest(key, valid))


def _closest(word: str, valid: Sequence[str]) -> str | None:
    """Return the name that was surely meant; `nearest` suggests some that may not have been."""
    return next(iter(difflib.get_close_matches(word, sorted(valid), n=1, cutoff=_SURE)), None)


M = TypeVar("M", bound=BaseModel)


def validate(schema: type[M], document: Document, more: Mapping[str, Any] = MappingProxyType({})) -> M | None:
    """Return the model, or None after adding every fault to the document's problems."""
    if document.outsized:
        document.problems += document.outsized
        return None
    context = {"folder": document.file.parent, **more}
    model, first = findings(schema, document.data, context)
    if model is not None:
        return model
    data, meant = _corrected(document, first)
    _, second = findings(schema, data, context)
    found = [finding for finding in first if finding.kind != "missing key" or finding.loc not in meant]
    known = {finding.loc for finding in found}
    found += [finding for finding in second if not any(_above(finding.loc, loc) for loc in known)]
    document.problems += [document.problem(finding.loc, finding.message) for finding in dict.fromkeys(found)]
    return None


def findings(schema: type[M], data: Any, context: Mapping[str, Any]) -> tuple[M | None, list[Finding]]:
    """Return the model, or None and what is wrong with the data."""
    try:
        return schema.model_validate_json(to_json(data), strict=True, context=dict(context)), []
    except ValidationError as invalid:
        faults = [dict(fault) for fault in invalid.errors()]
    findings = [finding for fault in faults for finding in explain(schema, data, fault)]
    # A list is also called too short when its items are wrong: what contains a fault says nothing of its own.
    inner = {finding.loc for finding in findings}
    return None, [one for one in findings if not any(_above(one.loc, loc) for loc in inner - {one.loc})]


def _above(loc: Loc, other: Loc) -> bool:
    """Whether `loc` is `other` or contains it: such a fault may only repeat the one inside."""
    return other[: len(loc)] == loc


def _corrected(document: Document, findings: Sequence[Finding]) -> tuple[Any, set[Loc]]:
    """Return a copy of the data with misspellings corrected, and the places of the corrected keys."""
    data, meant = copy.deepcopy(document.data), set[Loc]()
    for finding in findings:
        if finding.kind not in ("unknown key", "unknown value"):
            continue
        parent, key = data, finding.loc[-1]
        for part in finding.loc[:-1]:
            parent = parent[part]
        if finding.kind == "unknown value" and finding.meant is not None:
            parent[key] = finding.meant
        elif finding.kind == "unknown key":
            value = parent.pop(key)
            if finding.meant is not None and finding.meant not in parent:
                parent[finding.meant] = value
                place = (*finding.loc[:-1], finding.meant)
                document.alias(place, finding.loc)
                meant.add(place)
    return data, meant
