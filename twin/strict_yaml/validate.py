"""Validation in two passes: the second sees the data with misspellings corrected, and finds what they hid.

Pydantic compares fields with each other only once each is valid on its own, so one misspelt key would hide
every fault of that sort. Only misspellings are corrected: a guess at a wrong number could make up a fault.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import to_json

from twin.strict_yaml.document import Document, Loc
from twin.strict_yaml.explain import Finding, explain

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
