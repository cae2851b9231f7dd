"""Parameters of nodes as Foxglove's panel has them: one list, named '/node.parameter'."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from twin.bridge import types
from twin.bridge.msgs import new
from twin.bridge.parameters.values import Parameter, value_to_python
from twin.errors import BridgeError
from twin.web.foxglove.errands import Errands

_LIST, _GET, _SET = (f"rcl_interfaces/srv/{each}Parameters" for each in ("List", "Get", "Set"))


class RemoteParameters:
    """Asks nodes by their services; in a thread that may wait."""

    def __init__(self, errands: Errands) -> None:
        self._errands = errands

    def get(self, nodes: Iterable[str], wanted: Sequence[str]) -> dict[str, Any]:
        """Return values by '/node.parameter', all if none is named; a node that is silent is left out."""
        found: dict[str, Any] = {}
        for node, names in self._by_node(wanted) if wanted else ((node, None) for node in nodes):
            try:
                asked = self._names(node) if names is None else names
                values = self._call(node, _GET, names=asked).values
            except BridgeError:
                continue
            for name, value in zip(asked, values, strict=False):
                plain = _plain(value_to_python(value))
                if plain is not None:
                    found[f"{node}.{name}"] = plain
        return found

    def set(self, values: dict[str, Any]) -> None:
        """Set parameters; what a node refuses stays as it was, which a `get` then shows."""
        for node, names in self._by_node(sorted(values)):
            messages = [Parameter(name, value=values[f"{node}.{name}"]).to_parameter_msg() for name in names]
            self._call(node, _SET, parameters=messages)

    @staticmethod
    def _by_node(wanted: Iterable[str]) -> Iterator[tuple[str, list[str]]]:
        pairs = sorted(name.partition(".")[::2] for name in wanted)
        for node, group in groupby(pairs, key=lambda pair: pair[0]):
            yield node, [name for _, name in group]

    def _names(self, node: str) -> list[str]:
        return list(self._call(node, _LIST, prefixes=[], depth=0).result.names)

    def _call(self, node: str, kind: str, **fields: Any) -> Any:
        request = new(types.ServiceType(kind).Request, **fields)
        service = {_LIST: "list_parameters", _GET: "get_parameters", _SET: "set_parameters"}[kind]
        return self._errands.call(f"{node}/{service}", kind, request)


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value
