"""The command that makes a run again."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType


def twin_run(
    scenario: str | Path,
    overrides: Mapping[str, str] = MappingProxyType({}),
    *,
    options: Mapping[str, Sequence[object]] = MappingProxyType({}),
) -> str:
    """Return a line for a shell in the current folder.

    Args:
        scenario: Name or file, as it was given.
        overrides: Dotted keys -> YAML text.
        options: Others by name, each with its values.

    >>> twin_run("a b.yaml", {"seed": "3", "robots.0.pose": "{x: 1}"}, options={"node": ["n.py:make"]})
    "twin run 'a b.yaml' --seed 3 --set 'robots.0.pose={x: 1}' --node n.py:make"
    """
    words = ["twin", "run", str(scenario)]
    for key, text in overrides.items():
        words += ["--seed", text] if key == "seed" else ["--set", f"{key}={text}"]
    words += [
        word for name, values in options.items() for value in values for word in (f"--{name}", str(value))
    ]
    return shlex.join(words)
