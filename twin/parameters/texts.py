"""What the docstrings below a dataclass's fields say; read from the source when somebody asks."""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType

_NONE: Mapping[str, str] = MappingProxyType({})


@cache
def texts_of(kind: type) -> Mapping[str, str]:
    """Return the text below each field of a class and its bases, by field; empty where there is no source."""
    found: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        found |= _own_texts(base.__module__).get(base.__qualname__, _NONE)
    return MappingProxyType(found)


@cache
def _own_texts(module: str) -> Mapping[str, Mapping[str, str]]:
    """Return the texts of every class of a module, by the class's qualified name."""
    try:
        tree = ast.parse(inspect.getsource(sys.modules[module]))
    except (KeyError, OSError, TypeError, SyntaxError):
        return MappingProxyType({})
    found: dict[str, Mapping[str, str]] = {}
    _walk(tree, "", found)
    return found


def _walk(node: ast.AST, prefix: str, found: dict[str, Mapping[str, str]]) -> None:
    for item in ast.iter_child_nodes(node):
        if isinstance(item, ast.ClassDef):
            name = prefix + item.name
            found[name] = dict(_pairs(item))
            _walk(item, f"{name}.", found)
        elif isinstance(item, ast.FunctionDef):
            _walk(item, f"{prefix}{item.name}.<locals>.", found)


def _pairs(node: ast.ClassDef) -> list[tuple[str, str]]:
    return [
        (field.target.id, inspect.cleandoc(below.value.value))
        for field, below in zip(node.body, node.body[1:], strict=False)
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
        if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant)
        if isinstance(below.value.value, str)
    ]
