"""What the fields of a config declare."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType, SimpleNamespace
from typing import Any, get_type_hints

from twin.parameters.domain import Domain, domain_of, metadata_of
from twin.parameters.forms import Form, Marker, Name, Nav2
from twin.parameters.texts import texts_of

_END_OF_CLAUSE = re.compile(r"(?<=[^\s.])(?= ?\.\.\.|[.;:](\s|$))")


@dataclass(frozen=True)
class Declaration:
    """One field of a config, read from its annotation."""

    owner: type
    """The config."""
    field: str
    """Its attribute."""
    name: str
    """The parameter's, below the section that the config is; '' for a config inside that is no section."""
    domain: Domain | None
    """Which values it takes; None for configs inside, and for what is no parameter."""
    form: Form | None
    """How the value is told, if not as it is kept."""
    nav2: tuple[Nav2, ...]
    """How Nav2's files write it, where it is otherwise."""
    config: type | None
    """The config inside, if the annotation names just one."""
    default: Any
    """As configs keep it; None if it is made anew each time, MISSING if there is none."""
    markers: frozenset[Marker]
    """What else holds of it, such as `ReadOnly`."""

    @property
    def is_required(self) -> bool:
        """Whether it has no default."""
        return self.default is dataclasses.MISSING

    @property
    def text(self) -> str:
        """The docstring below the field, with the unit if it does not tell it."""
        text = texts_of(self.owner).get(self.field, "")
        unit = self.domain.unit if self.domain is not None else None
        if unit is None or "[" in text:
            return text
        told, count = _END_OF_CLAUSE.subn(f" [{unit.si}]", text, count=1)
        return told if count else f"{text} [{unit.si}].".lstrip()

    def tell(self, kept: Any) -> Any:
        """Return a value of the config as others are told it: SI, lists for tuples."""
        if isinstance(kept, tuple):
            return list(kept)
        return kept if self.form is None else self.form.tell(kept)

    def read(self, told: Any) -> Any:
        """Return a value as the config keeps it.

        Raises:
            ValueError: it is none; a sentence without its subject.
        """
        assert self.domain is not None
        return self.kept(self.domain.checked(told))

    def kept(self, checked: Any) -> Any:
        """Return a valid value as the config keeps it."""
        return checked if self.form is None or checked is None else self.form.read(checked)


def fields_of(config: type | object) -> Mapping[str, Declaration]:
    """Return what the fields of a frozen dataclass, or of an instance, declare: by field, in their order."""
    return _fields_of(config if isinstance(config, type) else type(config))


@cache
def _fields_of(config: type) -> Mapping[str, Declaration]:
    hints = get_type_hints(config, include_extras=True)
    fields = [field for field in dataclasses.fields(config) if field.init]
    return MappingProxyType({field.name: _declaration(config, field, hints[field.name]) for field in fields})


def names_of(config: type) -> SimpleNamespace:
    """Return what a config's parameters are called: `names_of(AmclConfig).sigma_hit` is 'sigma_hit'."""
    return SimpleNamespace(**{field: one.name for field, one in fields_of(config).items()})


def _declaration(owner: type, of: dataclasses.Field[Any], hint: Any) -> Declaration:
    field = of.name
    metadata = metadata_of(hint)
    form = next((one for one in metadata if isinstance(one, Form)), None)
    name = field
    if form is not None and field.endswith(form.suffix):
        name = field.removesuffix(form.suffix) + form.told_as
    name = next((one.name for one in metadata if isinstance(one, Name)), name)
    kind = getattr(hint, "__origin__", hint) if metadata else hint
    return Declaration(
        owner=owner,
        field=field,
        name=name,
        domain=domain_of(hint),
        form=form,
        nav2=tuple(one for one in metadata if isinstance(one, Nav2)),
        config=kind if isinstance(kind, type) and dataclasses.is_dataclass(kind) else None,
        default=of.default if of.default_factory is dataclasses.MISSING else None,
        markers=frozenset(one for one in metadata if isinstance(one, Marker)),
    )
