"""What fits into the base types of ROS messages."""

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
