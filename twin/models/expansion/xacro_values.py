"""What the expressions of a xacro file may make: operators and functions that refuse too large results."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from twin.models.expansion.sandbox import Refused

MAX_ITEMS = 1_000_000
"""Characters of a string, items of a list or range."""
MAX_BITS = 4096
"""Of an integer."""
MAX_FACTORIAL = 170
"""The largest whose result is a float."""

PLAIN = (str, int, float, bool, complex, list, tuple, dict, set, frozenset, type(None))
WIDE = re.compile(r"\d{4}|\*")


def checked(value: Any) -> Any:
    """Return a value that is not too large to go on with.

    Raises:
        Refused: It is.
    """
    if isinstance(value, str | bytes | list | tuple | dict | set | frozenset) and len(value) > MAX_ITEMS:
        raise Refused(f"a value of {len(value)} characters or items; at most {MAX_ITEMS} are taken")
    if isinstance(value, int) and value.bit_length() > MAX_BITS:
        raise Refused(f"an integer of {value.bit_length()} bits; at most {MAX_BITS} are taken")
    return value


def size_of(value: Any) -> int:
    """Return how many characters and items a value has, inner ones as often as they occur."""
    if isinstance(value, str | bytes | range):
        return len(value)
    size, waiting = 0, [value]
    while waiting:
        inner = waiting.pop()
        size += 1
        if isinstance(inner, list | tuple | set | frozenset):
            waiting += list(inner)
        elif isinstance(inner, dict):
            waiting += dict.values(inner)
        elif isinstance(inner, str):
            size += len(inner)
        if size + len(waiting) > MAX_ITEMS:
            raise Refused(f"a value of more than {MAX_ITEMS} characters or items inside of each other")
    return size


def _add(a: Any, b: Any) -> Any:
    return checked(a + b)


def _multiply(a: Any, b: Any) -> Any:
    for items, times in ((a, b), (b, a)):
        if isinstance(times, int) and isinstance(items, str | bytes | list | tuple):
            _limit(len(items) * times, MAX_ITEMS, "characters or items")
    if isinstance(a, int) and isinstance(b, int):
        _limit(a.bit_length() + b.bit_length() - 1, MAX_BITS, "bits")
    return a * b


def _power(a: Any, b: Any) -> Any:
    if isinstance(a, int) and isinstance(b, int) and abs(a) > 1:
        _limit((a.bit_length() - 1) * b, MAX_BITS, "bits")
    return a**b


def _shift(a: Any, b: Any) -> Any:
    if isinstance(a, int) and isinstance(b, int):
        _limit(a.bit_length() + b, MAX_BITS, "bits")
    return a << b


def _modulo(a: Any, b: Any) -> Any:
    if isinstance(a, str | bytes) and WIDE.search(a if isinstance(a, str) else a.decode("latin-1")):
        raise Refused("a format this wide is not for model files")
    return a % b


FUNCTIONS: Mapping[str, Callable[[Any, Any], Any]] = MappingProxyType(
    {"<+>": _add, "<*>": _multiply, "<**>": _power, "<<<>": _shift, "<%>": _modulo}
)
"""By the name under which an expression calls them."""


def _range(*args: int) -> range:
    numbers = range(*args)
    steps = -(-(numbers.stop - numbers.start) // numbers.step)
    _limit(steps, MAX_ITEMS, "items")
    return numbers


def _type(value: Any) -> type:
    if isinstance(value, PLAIN):
        return type(value)
    raise Refused(f"type() of a {type(value).__name__} is not for model files")


def _up_to_factorial(function: Callable[..., int], what: str) -> Callable[..., int]:
    def limited(n: int, *k: int) -> int:
        _limit(n, MAX_FACTORIAL, what)
        return function(n, *k)

    return limited


def _limit(number: int, most: int, what: str) -> None:
    if number > most:
        raise Refused(f"{number} {what}; at most {most} are taken" if number < 10**30 else f"too many {what}")


def guarded_symbols(symbols: dict[str, Any]) -> None:
    """Replace functions in a table of xacro's by ones that take no time and show no insides."""
    names = {
        "range": _range,
        "type": _type,
        "factorial": _up_to_factorial(math.factorial, "for a factorial"),
        "comb": _up_to_factorial(math.comb, "for a number of combinations"),
        "perm": _up_to_factorial(math.perm, "for a number of permutations"),
    }
    for table in (symbols, *(value for value in symbols.values() if isinstance(value, dict))):
        dict.pop(table, "vars", None)
        for name in [name for name in names if dict.__contains__(table, name)]:
            dict.__setitem__(table, name, names[name])
