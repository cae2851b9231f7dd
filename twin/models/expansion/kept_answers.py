"""Answers of the process that expands xacro, kept for as long as all that they were made of is the same.

That is the request, the program, the content of every file that was read, that a file was missing, and where
packages were found. Faults are not kept, nor what came of a pattern that names files.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from twin.files.kept import hash_of, keep, kept
from twin.models.urdf.packages import Packages

KIND = "xacro"


def kept_answer(request: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the answer to an equal request, if it would be the same today."""
    answer = kept(KIND, _key(request))
    try:
        holds = all(hash_of(file) == was for file, was in answer["read"].items()) and _found(request, answer)
    except (TypeError, KeyError, AttributeError):
        return None
    return answer if holds else None


def keep_answer(request: Mapping[str, Any], answer: Mapping[str, Any]) -> None:
    """Keep an answer for later, unless it may not last."""
    if answer.get("read"):
        keep(KIND, _key(request), answer)


def _found(request: Mapping[str, Any], answer: Mapping[str, Any]) -> bool:
    packages = Packages(request["packages"])
    return all(name in packages and str(packages[name]) == was for name, was in answer["found"].items())


def _key(request: Mapping[str, Any]) -> str:
    told = {name: sorted(one.items()) if isinstance(one, dict) else one for name, one in request.items()}
    return repr((sorted(told.items()), os.getcwd(), sys.version, version("xacro"), _program()))


@cache
def _program() -> tuple[str | None, ...]:
    """Return what expands, which may be edited without another version."""
    return tuple(hash_of(file) for file in sorted(Path(__file__).parent.glob("*.py")))
