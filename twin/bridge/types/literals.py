"""What fits into the base types of ROS messages, and values of constants and defaults in definitions.

Literals are those of rosidl_adapter's parser; a '#' inside of quotes belongs to the text.
"""

from __future__ import annotations

from typing import Literal

INTEGERS = {
    f"{sign}int{bits}": (0, 2**bits - 1) if sign else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    for sign in ("", "u")
    for bits in (8, 16, 32, 64)
} | {"char": (0, 255), "byte": (0, 255), "octet": (0, 255)}
"""Base type -> smallest and largest value."""
FLOATS = {"float32": 3.4028234663852886e38, "float64": float("inf")}
"""Base type -> largest finite value that it is checked for."""
STRINGS = ("string", "wstring")
BASE_TYPES = ("bool", "byte", "char", *FLOATS, *(name for name in INTEGERS if "int" in name), *STRINGS)
"""What a .msg file may name without a package."""

Many = Literal["", "array", "bounded", "sequence"]
"""Empty for a single value."""

MOST_NUMBERS, MOST_OBJECTS = 2**24, 2**12
"""Largest arrays of fixed length, of numbers and of texts or messages: code is generated for each element."""


Scalar = bool | int | float | str
Value = Scalar | list[Scalar]


def parse_scalar(base: str, text: str, string_bound: int = 0) -> Scalar:
    """Return the value that a literal has for a base type.

    Raises:
        ValueError: it has none; says what would be valid.
    """
    if base in STRINGS:
        return _parse_text(text, string_bound)
    if base == "bool":
        if text.lower() not in ("true", "false", "1", "0"):
            raise ValueError(f"{text!r} is no bool; valid: true, false, 1, 0")
        return text.lower() in ("true", "1")
    if base in FLOATS:
        try:
            return float(text)
        except ValueError:
            raise ValueError(f"{text!r} is no number; valid: such as 1.5 or -2e3") from None
    low, high = INTEGERS[base]
    valid = f"valid for {base}: a whole number from {low} to {high}"
    try:
        value = int(text) if text.lstrip("+-").isdecimal() else int(text, 0)
    except ValueError:
        raise ValueError(f"{text!r} is no whole number; {valid}") from None
    if not low <= value <= high:
        raise ValueError(f"{text} is out of range; {valid}")
    return value


def parse_list(base: str, text: str, string_bound: int, many: str, size: int) -> list[Scalar]:
    """Return the values of a literal such as [1, 2, 3].

    Args:
        base: the elements' type.
        text: the literal.
        string_bound: most characters of an element; 0 for any.
        many: array, bounded or sequence.
        size: of an array or the bound.

    Raises:
        ValueError: not such a list, or not as many as the field has.
    """
    if not (text.startswith("[") and text.endswith("]") and len(text) >= 2):
        raise ValueError(f"the default {text!r} is no list; valid: such as [1, 2]")
    values = [parse_scalar(base, item, string_bound) for item in split_items(text[1:-1])]
    if (many == "array" and len(values) != size) or (many == "bounded" and len(values) > size):
        valid = "exactly" if many == "array" else "at most"
        raise ValueError(f"the default has {len(values)} elements; valid: {valid} {size}")
    return values


def split_items(text: str) -> list[str]:
    """Split 'a, "b, c"' at the commas outside of quotes."""
    items, current, quote = [], "", ""
    for previous, character in zip(" " + text, text, strict=False):
        if quote:
            quote = "" if character == quote and previous != "\\" else quote
        elif character in "\"'" and not current.strip():
            quote = character
        elif character == ",":
            items.append(current.strip())
            current = ""
            continue
        current += character
    return [*items, current.strip()] if current.strip() or items else []


def without_comment(line: str) -> str:
    """Return a line up to the '#' that starts its comment."""
    quote = ""
    for at, character in enumerate(line):
        if quote:
            quote = "" if character == quote and line[at - 1] != "\\" else quote
        elif character == "#":
            return line[:at].rstrip()
        elif character in "\"'" and line[at - 1 : at] in ("", " ", "\t", "=", "[", ",") and _closes(line, at):
            quote = character
    return line.rstrip()


def _closes(line: str, at: int) -> bool:
    """Say whether the quote at `at` has a partner; an apostrophe has none."""
    end = line.find(line[at], at + 1)
    while end > 0 and line[end - 1] == "\\":
        end = line.find(line[at], end + 1)
    return end > 0


def _parse_text(text: str, bound: int) -> str:
    quote = text[:1]
    if quote in ("'", '"') and len(text) >= 2 and text.endswith(quote):
        text = text[1:-1]
        if quote in text.replace("\\" + quote, ""):
            raise ValueError(f"the text {text!r} has quotes inside that are not escaped; valid: \\{quote}")
        text = text.replace("\\" + quote, quote)
    if bound and len(text) > bound:
        raise ValueError(f"the text {text!r} has {len(text)} characters; valid: at most {bound}")
    return text
