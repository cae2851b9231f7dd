"""Running the real command in this process, and keeping an eye on its folder."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

from tests.oracles.odd.case import Case, Content
from twin.cli.app import run_app


@dataclass(frozen=True)
class Outcome:
    """What a command did."""

    code: int
    out: str
    err: str


def twin(*arguments: object) -> Outcome:
    """Run `twin` as from a shell; anything but an exit escapes."""
    out, err = io.StringIO(), io.StringIO()
    with (
        mock.patch.object(sys, "argv", ["twin", *map(str, arguments)]),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            run_app()
        except SystemExit as end:
            return Outcome(0 if end.code is None else int(end.code), out.getvalue(), err.getvalue())
    raise AssertionError("twin did not exit")


def write(case: Case, folder: Path) -> Path:
    """Write a case's files; return the robot file."""
    for name, content in {**case.files, case.name: case.urdf}.items():
        put(folder / name, content)
    return folder / case.name


def put(path: Path, content: Content) -> None:
    """Write a file, or let `content` make it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if callable(content):
        content(path)
    elif isinstance(content, bytes):
        path.write_bytes(content)
    else:
        path.write_text(content, encoding="utf-8")


def snapshot(folder: Path) -> dict[str, tuple[int, int]]:
    """Return size and time of everything below a folder, links not followed."""
    return {str(path.relative_to(folder)): _seen(path) for path in _walk(folder)}


def _walk(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.iterdir()):
        yield path
        if path.is_dir() and not path.is_symlink():
            yield from _walk(path)


def _seen(path: Path) -> tuple[int, int]:
    status = path.lstat()
    return (0, 0) if path.is_dir() else (status.st_size, status.st_mtime_ns)
