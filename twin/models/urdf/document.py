"""Reading XML elements strictly, collecting every problem instead of stopping at the first."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lxml import etree

from twin.errors import ModelError, Problem
from twin.models.shapes import SkippedMesh
from twin.models.urdf.line_table import LineTable
from twin.models.urdf.packages import Packages
from twin.models.urdf.plain_numbers import plain_number, plain_numbers
from twin.models.urdf.xml_text import scan
from twin.plain_text import UNSEEN

Element = Any
"""An lxml element; the library ships no types."""

LARGEST = 1e10
"""MuJoCo takes no larger number [SI]; only limits may be larger, as some write them for none at all."""
FARTHEST = 1e8
"""Largest coordinate of an origin [m]: further away masses drown in rounding."""
NAMES = ("name", "link", "joint", "reference")
"""Attributes with the name of a thing."""
NAMED = ("link", "joint", "parent", "child", "mimic")
_BREAKS = re.compile(f"[\x00-\x1f{UNSEEN}]")
PLACES = ("link", "joint", "gazebo", "sensor")
"""Elements that a user knows by name."""


@dataclass
class Report:
    """The problems of one file, in the order they were found."""

    source: Path
    table: LineTable | None = None
    """Of a text that xacro wrote; otherwise the text's lines are those of `source`."""
    packages: Packages | None = None
    """What its text may name files of; the loader tells."""
    problems: list[Problem] = field(default_factory=list)
    warnings: list[Problem] = field(default_factory=list)
    """What the robot can be used without."""
    _lines: dict[Element, int] = field(default_factory=dict, repr=False)
    skipped_meshes: list[SkippedMesh] = field(default_factory=list)
    """What the options allow to leave out."""

    def add(self, element: Element | None, message: str, *, code: str) -> None:
        """Note a problem of `element`; its `code` is one of `twin.models.checks.codes`."""
        self.problems.append(self._problem(element, message, code))

    def warn(self, element: Element | None, message: str, *, code: str) -> None:
        """Note that a part of `element` is left out; the message ends in `; ` and how to mend it."""
        self.warnings.append(self._problem(element, message, code))

    def _problem(self, element: Element | None, message: str, code: str) -> Problem:
        line = self.line(element) or None
        return Problem(message, self.source, line, code=code, element=place(element))

    def line(self, element: Element | None) -> int:
        """Return the 1-based line of an element in the user's file, 0 where that is unknown.

        After xacro it is a `SourceLine`, as an element may come from an included file.
        """
        return 0 if element is None else self._lines.get(element, 0)

    def locate(self, root: Element, lines: Sequence[int]) -> None:
        """Take the lines of all elements of a text, given in the order of start tags."""
        known = lines if self.table is None else self.table.lines()
        elements = list(root.iter())
        # A name with markup in it, of <xacro:element>, makes other elements than xacro had.
        self._lines = dict(zip(elements, known, strict=True)) if len(elements) == len(known) else {}

    def raise_if_any(self) -> None:
        """Raise ModelError with all problems found so far."""
        if self.problems:
            raise ModelError(self.problems)

    def numbers(
        self, element: Element, name: str, count: int, default: tuple[float, ...] | None = None
    ) -> tuple[float, ...]:
        """Return `count` finite numbers; a wrong attribute is noted and becomes the default or zeros."""
        fallback = default if default is not None else (0.0,) * count
        text, needed = element.get(name), "a number" if count == 1 else f"{count} numbers"
        if text is None:
            if default is None:
                message = f"{describe(element)} has no {name}=; {needed} needed"
                self.add(element, message, code="missing-attribute")
            return fallback
        most = FARTHEST if (element.tag, name) == ("origin", "xyz") else LARGEST
        try:
            values = plain_numbers(text)
        except ValueError:
            fault = f"is not {needed}"
        else:
            if len(values) != count:
                fault = f"has {len(values)} numbers, not {count}"
            elif not all(map(math.isfinite, values)):
                fault = "is not finite"
            elif max(map(abs, values)) > most and element.tag != "limit":
                fault = f"is out of range; at most {most:g}"
            else:
                return values
        self.add(element, f"{describe(element)}: {name}='{text}' {fault}", code="bad-number")
        return fallback

    def number(self, element: Element, name: str, default: float | None = None) -> float:
        """Return one finite number of an attribute."""
        return self.numbers(element, name, 1, None if default is None else (default,))[0]

    def optional_number(self, element: Element, name: str) -> float | None:
        """Return one finite number of an attribute, or None without it."""
        return None if element.get(name) is None else self.number(element, name, 0.0)

    def child_number(self, element: Element, *names: str) -> float | None:
        """Return the number in the first child of one of these names or paths, or None."""
        child = first(element, *names)
        if child is None:
            return None
        text = (child.text or "").strip()
        try:
            value = plain_number(text)
        except ValueError:
            value = math.nan
        if abs(value) <= LARGEST:
            return value
        fault = f"is out of range; at most {LARGEST:g}" if math.isfinite(value) else "is not a finite number"
        self.add(child, f"{describe(element)}: <{child.tag}>{text}</{child.tag}> {fault}", code="bad-number")
        return None

    def required(self, element: Element, name: str) -> str:
        """Return a non-empty attribute; its absence is noted."""
        text = (element.get(name) or "").strip()
        if not text:
            self.add(element, f"{describe(element)} has no {name}=", code="missing-attribute")
        return text


def parse(text: bytes, report: Report) -> Element:
    """Return the root element of a URDF text in UTF-8; the report then knows the lines of its elements.

    Raises:
        ModelError: Not well-formed, too large, too deep, or with a DOCTYPE.
    """
    lines = scan(text, report.source, has_lines=report.table is None)
    try:
        root = etree.fromstring(text, safe_parser(remove_pis=True))
    except etree.XMLSyntaxError as error:
        line = error.lineno if report.table is None else None
        message = " ".join(error.msg.split()).partition(", line ")[0]
        if "prefix" in message:
            message += "; declare it in the outermost element: xmlns:PREFIX='...'"
        problem = Problem(f"not well-formed XML: {message}", report.source, line, code="bad-xml")
        raise ModelError(problem) from None
    _drop_default_namespace(root)
    report.locate(root, lines)
    _check_names(root, report)
    _refuse_unexpanded(root, report)
    if root.tag != "robot":
        message = f"the root element is <{root.tag}>; a URDF file has <robot name='...'>"
        report.add(root, message, code="not-urdf")
        report.raise_if_any()
    return root


def safe_parser(**more: bool) -> etree.XMLParser:
    """Return a parser of UTF-8 that leaves out comments and opens nothing; `more` are options of lxml's."""
    return etree.XMLParser(
        encoding="utf-8",
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        remove_comments=True,
        **more,
    )


def first(element: Element, *names: str) -> Element | None:
    """Return the first child found under one of these names or paths, tried in order."""
    return next((child for name in names if (child := element.find(name)) is not None), None)


def text_of(element: Element, *names: str) -> str | None:
    """Return the stripped text of the first child of one of these names; None if absent or empty."""
    child = first(element, *names)
    return None if child is None else ((child.text or "").strip() or None)


def describe(element: Element) -> str:
    """Return how to call an element in a message: by its own name, or by its tag and what it belongs to."""
    name = element.get("name")
    return f"{element.tag} '{name}'" if name else f"<{element.tag}>{_of_owner(element)}"


def place(element: Element | None) -> str:
    """Return the link, joint, gazebo element or sensor that an element is or belongs to, else `robot`."""
    if element is None:
        return "robot"
    name = element.get("name") or element.get("reference")
    if name and element.tag in PLACES:
        return f"{element.tag} '{name}'"
    return _of_owner(element).removeprefix(" of ") or "robot"


def owner(element: Element) -> str:
    """Return how to call the link, joint, sensor or gazebo element that an element belongs to."""
    return _of_owner(element).removeprefix(" of ") or f"<{element.tag}>"


def _of_owner(element: Element) -> str:
    for parent in element.iterancestors():
        name = parent.get("name") or parent.get("reference")
        if name and parent.tag in PLACES:
            return f" of {parent.tag} '{name}'"
    return ""


def _drop_default_namespace(root: Element) -> None:
    # URDF has none; ROS's own reader takes no notice of one.
    for element in root.iter():
        if element.prefix is None:
            element.tag = etree.QName(element).localname


def _check_names(root: Element, report: Report) -> None:
    """Note links and joints whose names have spaces at their ends or what is not seen, and mend them."""
    fault = "has spaces at its ends or line breaks, or characters that are not seen; remove them"
    for element, attribute, name in list(_names(root)):
        plain = " ".join(filter(None, _BREAKS.split(name))).strip()
        if plain == name:
            continue
        element.set(attribute, plain)
        if plain and element.tag in NAMED:
            report.add(element, f"{describe(element)}: {attribute}= {fault}", code="bad-name")


def _names(root: Element) -> Iterator[tuple[Element, str, str]]:
    """Yield elements, attributes that name a thing, and the names."""
    for element in root.iter():
        for attribute, name in element.items():
            if name and attribute in NAMES:
                yield element, attribute, name


def _refuse_unexpanded(root: Element, report: Report) -> None:
    """Note names and elements that xacro would have replaced, had the file declared its prefix."""
    declare = "declare xmlns:xacro='http://www.ros.org/wiki/xacro' in <robot> and use that prefix"
    named = {element for element, _, name in _names(root) if "${" in name or "$(" in name}
    found = [
        element
        for element in root.iter()
        if element in named or element.tag.partition("}")[0].endswith("/xacro")
    ]
    if found:
        first, more = found[0], f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        what = f"<{first.prefix}:{etree.QName(first).localname}>" if first.prefix else describe(first)
        report.add(first, f"{what}{more} is left as xacro found it; {declare}", code="xacro")
