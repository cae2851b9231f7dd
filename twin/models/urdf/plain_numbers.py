"""Numbers as C++ readers of URDF take them: Python's float() also reads 1_000 and digits of other scripts."""

from __future__ import annotations

import re

_NUMBER = re.compile(
    r"[+-]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]+)?|inf|infinity|nan)", re.IGNORECASE
)
_WORD = re.compile(r"[^ \t\r\n]+")


def plain_number(word: str) -> float:
    """Return a number in plain digits; it may be infinite or NaN.

    Raises:
        ValueError: It is none.
    """
    if not _NUMBER.fullmatch(word):
        raise ValueError(f"'{word}' is no plain number")
    return float(word)


def plain_numbers(text: str) -> tuple[float, ...]:
    """Return the numbers of a text, with XML's white space between them.

    Raises:
        ValueError: One of them is none.
    """
    return tuple(plain_number(word) for word in _WORD.findall(text))
