"""Names of what is varied, as short as they can be."""

from __future__ import annotations

from collections.abc import Sequence


def short_names(keys: Sequence[str], *, with_word: bool = True) -> dict[str, str]:
    """Return the shortest ends of dotted keys that differ from each other.

    Args:
        keys: Dotted keys.
        with_word: Whether an end is to begin with a word; otherwise it only is more than a number.

    >>> short_names(["robots.0.pose.x", "robots.1.pose.x"], with_word=False)
    {'robots.0.pose.x': '0.pose.x', 'robots.1.pose.x': '1.pose.x'}
    """
    names = {}
    for key in keys:
        parts = key.split(".")
        ends = [".".join(parts[-count:]) for count in range(1, len(parts) + 1)]
        alone = (end for end in ends if sum(f".{other}".endswith(f".{end}") for other in keys) == 1)
        names[key] = next((e for e in alone if not (e[0] if with_word else e).isdecimal()), key)
    return names
