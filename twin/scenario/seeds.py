"""Seeds as a text: `0:1000`, `1..10`, `1,5,9`; it means the same in a file and on the command line."""

from __future__ import annotations

import re

_PART = re.compile(r"(\d{1,19})(?:\.\.(\d{1,19})|:(\d{1,19})(?::(\d{1,19}))?)?")


def parse_seeds(text: str, most: int) -> tuple[int, ...]:
    """Return the seeds of a text, in its order.

    Args:
        text: Numbers and ranges with commas between them: `1..10` has both ends, `0:10` and `0:10:2` go up to
            their end, without it, as in Python.
        most: How many there may be.

    Raises:
        ValueError: It is none of these, has a seed twice, or too many.
    """
    seeds: list[int] = []
    for part in text.split(","):
        found = _PART.fullmatch(part.strip())
        if found is None or found[4] == "0":
            raise ValueError("must be a list of seeds, 1,5,9, or a range such as 1..10 or 0:10 (without 10)")
        first, end = int(found[1]), int(found[3] or int(found[2] or found[1]) + 1)
        if first >= end:
            raise ValueError(f"has no seed in {part.strip()}; the first number must be less than the second")
        if end > 1 << 63:
            raise ValueError("must be seeds of at most 63 bits")
        span = range(first, end, int(found[4] or 1))
        if len(seeds) + len(span) > most:
            raise ValueError(f"must be at most {most} seeds")
        seeds += span
    if len(set(seeds)) < len(seeds):
        raise ValueError("has a seed twice")
    return tuple(seeds)
