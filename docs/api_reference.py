"""The part of docs/api.md that follows from the code; docs/reference.py writes it."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import re
import textwrap
from collections.abc import Mapping
from typing import Any

import twin

HIDDEN = ("model_config",)
"""Names that pydantic wants."""


def api() -> str:
    """Return the names of `import twin`, from signatures and docstrings."""
    parts = []
    for name in twin.__all__:
        found = getattr(twin, name)
        if inspect.ismodule(found):
            parts += [f"### `twin.{name}`", "", _prose(inspect.getdoc(found)), ""]
        elif inspect.isclass(found):
            parts += [f"### `class twin.{name}`", "", _prose(inspect.getdoc(found)), "", *_members(found)]
        else:
            parts += [f"### `twin.{name}{_signature(found)}`", "", _prose(inspect.getdoc(found)), ""]
    return "\n".join(parts)


def _members(kind: type[Any]) -> list[str]:
    """Return fields, properties and methods of a class, those of bases of this project included."""
    parts = []
    made = vars(kind).get("__init__")
    if made is not None and (made.__doc__ or "").strip() and not made.__doc__.startswith("Initialize self"):
        parts += [f"#### `{kind.__name__}{_signature(made)}`", "", _prose(inspect.getdoc(made)), ""]
    known = {}
    for base in reversed([base for base in kind.__mro__ if base.__module__.startswith("twin.")]):
        known |= vars(base)
    for name, member in known.items():
        if name.startswith("_") or name in HIDDEN:
            continue
        if isinstance(member, property):
            parts += [f"#### `.{name}`", "", _prose(inspect.getdoc(member)), ""]
        elif inspect.isfunction(member) or isinstance(member, staticmethod | classmethod):
            parts += [
                f"#### `.{name}{_signature(getattr(kind, name))}`",
                "",
                _prose(inspect.getdoc(member)),
                "",
            ]
    if dataclasses.is_dataclass(kind):
        meanings = _field_docs(kind)
        fields = [field.name for field in dataclasses.fields(kind)]
        parts += [f"- `.{field}`: {' '.join(meanings.get(field, '').split())}" for field in fields]
        parts.append("")
    return parts


def _signature(function: Any) -> str:
    """Return parameters without the types, which the text tells; a default as it is written."""
    parameters = inspect.signature(function).parameters.values()
    plain = [
        parameter.replace(annotation=parameter.empty, default=_Shown.of(parameter.default))
        for parameter in parameters
        if parameter.name != "self"
    ]
    return str(inspect.Signature(plain))


class _Shown(str):
    """A default as it is shown."""

    __slots__ = ()

    @classmethod
    def of(cls, default: Any) -> Any:
        if default is inspect.Parameter.empty:
            return default
        return cls("{}" if isinstance(default, Mapping) else repr(default))

    def __repr__(self) -> str:
        return str(self)


def _prose(text: str | None) -> str:
    """Return a docstring as Markdown: sections of arguments, results and errors as lists."""
    lines: list[str] = []
    is_list = False
    for line in (text or "").splitlines():
        head = line.strip()
        if head in ("Args:", "Returns:", "Raises:"):
            is_list = True
            lines += [f"*{head}*", ""]
        elif is_list and re.match(r" {4}\w[\w.]*: ", line):
            name, _, rest = head.partition(": ")
            lines.append(f"- `{name}`: {rest}")
        else:
            lines.append(f"  {head}" if is_list and head else head)
    return "\n".join(lines).strip()


def _field_docs(kind: type[Any]) -> dict[str, str]:
    """Return the string below each field of a class."""
    (body,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
    assert isinstance(body, ast.ClassDef)
    return {
        item.target.id: str(ast.literal_eval(text.value))
        for item, text in zip(body.body, body.body[1:], strict=False)
        if isinstance(item, ast.AnnAssign)
        and isinstance(item.target, ast.Name)
        and isinstance(text, ast.Expr)
    }
