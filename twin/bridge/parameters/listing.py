"""Which parameters a prefix and a depth choose (rclpy's Node.list_parameters)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from twin.bridge.msgs import ListParametersResult

SEPARATOR = "."
DEPTH_RECURSIVE = 0
"""rcl_interfaces/srv/ListParameters: as deep as there are names."""


def listed(names: Iterable[str], prefixes: Sequence[str], depth: int) -> ListParametersResult:
    """Return the names that are or are below one of the prefixes, and what they are below of.

    Args:
        names: All there are, parts separated by dots.
        prefixes: None of them means all names.
        depth: How many parts a name may have, after its prefix; 0: any number.
    """

    def wanted(name: str) -> bool:
        if not prefixes:
            return _deep_enough(name, depth)
        return any(
            name == prefix
            or (name.startswith(prefix + SEPARATOR) and _deep_enough(name[len(prefix) + 1 :], depth))
            for prefix in prefixes
        )

    chosen = [name for name in names if wanted(name)]
    parents = dict.fromkeys(name.rpartition(SEPARATOR)[0] for name in chosen if SEPARATOR in name)
    return ListParametersResult(chosen, list(parents))


def _deep_enough(name: str, depth: int) -> bool:
    return depth == DEPTH_RECURSIVE or name.count(SEPARATOR) < depth
