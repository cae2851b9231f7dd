"""Names that a person typed, and what to say if the graph does not have them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import typer

from twin.errors import COMPARED, BridgeError, nearest


def absolute(name: str) -> str:
    """Return a name with the slash in front that a person may leave out."""
    return name if name.startswith("/") else f"/{name}"


def full_type(name: str, kind: str, word: str, example: str) -> str:
    """Return a type's whole name, in which the kind (msg, srv, action) may be left out.

    Raises:
        BridgeError: it is of another kind.
    """
    from twin.bridge import types

    parts = types.parts(name if name.count("/") != 1 else name.replace("/", f"/{kind}/"))
    if parts.kind != kind:
        raise BridgeError(f"{name} is no {word}; valid is for example {example}")
    return "/".join(parts)


def unknown(kind: str, name: str, known: Iterable[str]) -> BridgeError:
    """Return the error that something is not in the graph, with the nearest name."""
    return BridgeError(f"Unknown {kind} '{name}'; {instead(kind, name, known)}")


def known(kind: str, name: str, names: Mapping[str, Sequence[str]], hidden: bool = True) -> str:
    """Return the absolute name of a topic, service or action that is there.

    Raises:
        BridgeError: it is not; tells the nearest, of hidden ones only if they are wanted.
    """
    if absolute(name) not in names:
        raise unknown(kind, name, shown(names, hidden))
    return absolute(name)


def print_types(kind: str, name: str, names: Mapping[str, Sequence[str]], hidden: bool = True) -> None:
    """Print the types of what has a name; raises what `known` raises."""
    for typename in names[known(kind, name, names, hidden)]:
        typer.echo(typename)


def instead(kind: str, name: str, known: Iterable[str]) -> str:
    """Return the nearest of the names that there are, and all of them."""
    names = list(known)
    return nearest(name, names) if names else f"there are no {kind}s"


def print_names(names: Mapping[str, Sequence[str]], *, count: bool, show_types: bool = False) -> None:
    """Print names, with their types if wanted, or only how many there are."""
    if count:
        typer.echo(len(names))
        return
    for name, types in names.items():
        typer.echo(f"{name} [{', '.join(types)}]" if show_types else name)


def of_type(wanted: str, names: Mapping[str, Sequence[str]]) -> dict[str, Sequence[str]]:
    """Return the names that have a type."""
    return {name: types for name, types in names.items() if wanted in types}


def shown(names: Mapping[str, Sequence[str]], hidden: bool) -> dict[str, Sequence[str]]:
    """Return the names without those that ROS hides, unless these are wanted too."""
    from twin.bridge.graph import is_hidden

    return {name: types for name, types in names.items() if hidden or not is_hidden(name)}


def hint_at_nearest(kind: str, name: str, known: Iterable[str]) -> None:
    """Say on stderr, before a wait that may last for ever, that something else has nearly this name."""
    import difflib

    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.5) if len(names) <= COMPARED else []
    if close:
        typer.echo(f"WARNING: there is no {kind} {name} yet; did you mean {close[0]}?", err=True)
