"""Expanding xacro in a guarded child process, unless it is known what becomes of it.

Answers of that process are kept for as long as all that they were made of is the same: the request, the
program, the content of every file that was read, that a file was missing, and where packages were found.
Faults are not kept, nor what came of a pattern that names files.
"""

from __future__ import annotations

import json
import os
import pickle
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from twin.errors import ModelError, Problem
from twin.files.kept import hash_of, keep, kept
from twin.models.expansion.sandbox import CPU_SECONDS
from twin.models.options import DEFAULTS, ReadOptions
from twin.models.urdf.line_table import LineTable
from twin.models.urdf.packages import PackagePath, Packages

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


TIME_LIMIT_S = 60.0
"""By the clock, however busy the computer is; what repeats without end runs out of CPU time before."""
_ROOT = Path(__file__).parents[3]
"""The folder with the package `twin` that is running, installed or not."""
_START = (
    "import sys; sys.path.insert(0, sys.argv[1]); from twin.models.expansion.xacro_worker import main; main()"
)


@dataclass(frozen=True, kw_only=True)
class Expansion:
    """What became of a xacro file."""

    urdf: str
    """The text without xacro."""
    lines: LineTable
    """Where its elements were written."""


def expand(source: Path, options: ReadOptions = DEFAULTS, *, time_limit_s: float = TIME_LIMIT_S) -> Expansion:
    """Return the URDF text of a xacro file.

    Args:
        source: The file.
        options: Arguments, packages, and what the file may read.
        time_limit_s: Of the whole expansion [s, wall clock].

    Raises:
        ModelError: xacro refuses the file, it tries what a model file may not do, or it takes too long.
    """
    request = {
        "file": str(source.absolute()),
        "args": dict(options.args),
        "environment": {name: os.environ[name] for name in options.allow_env if name in os.environ},
        "packages": PackagePath.of(source, options),
    }
    answer = kept_answer(request)
    if answer is None:
        answer = _run_worker(request, source, time_limit_s)
        keep_answer(request, answer)
    if "error" in answer:
        file = source if answer["file"] is None else _as_given(answer["file"], source)
        raise ModelError(Problem(f"xacro: {answer['error']}", file, answer["line"], code=answer["code"]))
    files = tuple(_as_given(file, source) for file in answer["files"])
    return Expansion(
        urdf=answer["urdf"], lines=LineTable(files=files, places=tuple(map(tuple, answer["places"])))
    )


def _run_worker(request: Mapping[str, object], source: Path, time_limit_s: float) -> dict[str, Any]:
    # Isolated and with an empty environment: $(env ...) and PYTHON* variables do not reach into a model.
    command = [sys.executable, "-I", "-X", "utf8", "-c", _START, str(_ROOT)]
    with tempfile.TemporaryFile() as output:  # a file, as its size can be limited
        try:
            done = subprocess.run(
                command,
                input=pickle.dumps(request),
                stdout=output,
                stderr=subprocess.PIPE,
                timeout=time_limit_s,
                env={},
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise _endless(f"{time_limit_s:g} s", source) from None
        if done.returncode == -signal.SIGXCPU:
            raise _endless(f"{CPU_SECONDS} s of computing", source)
        if done.returncode != 0:
            last = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
            reason = last or [f"exit code {done.returncode}; it may have taken too much time or memory"]
            raise ModelError(Problem(f"xacro failed: {reason[0]}", source, code="xacro"))
        output.seek(0)
        answer: dict[str, Any] = json.load(output)
        return answer


def _endless(limit: str, source: Path) -> ModelError:
    sentence = f"xacro did not finish within {limit}; look for what repeats without end"
    return ModelError(Problem(sentence, source, code="xacro"))


def _as_given(file: str, source: Path) -> Path:
    """Return a file's path as the user would write it: relative if the path of the robot file is."""
    path = Path(os.path.normpath(file))
    if path == source.absolute():
        return source
    if not source.is_absolute() and path.is_relative_to(Path.cwd()):
        return path.relative_to(Path.cwd())
    return path
