"""Names that a person typed, and what to say if the graph does not have them."""

from __future__ import annotations

from collections.abc import Iterable

from twin.errors import BridgeError, nearest


def absolute(name: str) -> str:
    """Return a name with the slash in front that a person may leave out."""
    return name if name.startswith("/") else f"/{name}"


def unknown(kind: str, name: str, known: Iterable[str]) -> BridgeError:
    """Return the error that something is not in the graph, with the nearest name."""
    return BridgeError(f"Unknown {kind} '{name}'; {instead(kind, name, known)}")


def instead(kind: str, name: str, known: Iterable[str]) -> str:
    """Return the nearest of the names that there are, and all of them."""
    names = list(known)
    return nearest(name, names) if names else f"there are no {kind}s"
