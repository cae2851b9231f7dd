"""Finds .msg, .srv and .action files: in a package, in a workspace, below `share` of an installation."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from twin.bridge.types.parser import MESSAGE, SECTIONS, Definition
from twin.errors import BridgeError, Problem
from twin.files.reading import read_text

_PACKAGE = re.compile(r"[a-z][a-z0-9_]*")
_PACKAGE_TAG = re.compile(r"<name>\s*([^<\s]+)\s*</name>")
_IGNORED = ("COLCON_IGNORE", "AMENT_IGNORE", "CATKIN_IGNORE")
_LARGEST = 1_000_000


def find_definitions(folder: Path) -> list[Definition]:
    """Return the definitions of all packages in a folder, sorted.

    A package is a folder with `msg`, `srv` or `action` inside; its name is that of its package.xml, without
    one the folder's. Folders with COLCON_IGNORE, AMENT_IGNORE or CATKIN_IGNORE are left out, as by colcon.

    Raises:
        BridgeError: no such folder, nothing in it, or all names and files that cannot be used.
    """
    if not folder.is_dir():
        raise BridgeError(
            f"there is no folder {folder}; valid: a folder with msg/*.msg, srv/*.srv, action/*.action"
        )
    if folder.name in SECTIONS:
        folder = folder.absolute().parent
    problems: list[Problem] = []
    found = [
        definition
        for package in _packages(folder.absolute())
        for definition in _definitions(package, problems)
    ]
    if problems:
        raise BridgeError(problems)
    if not found:
        raise BridgeError(
            f"{folder} holds no interfaces; valid: msg/*.msg, srv/*.srv, action/*.action in it or below"
        )
    return found


def _packages(root: Path) -> Iterator[Path]:
    for current, folders, files in os.walk(root):
        if any(name in files for name in _IGNORED):
            folders.clear()
            continue
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        here = Path(current)
        if any(next((here / kind).glob(f"*.{kind}"), None) for kind in SECTIONS if kind in folders):
            yield here


def _definitions(package: Path, problems: list[Problem]) -> Iterator[Definition]:
    name = _package_name(package)
    if not _PACKAGE.fullmatch(name):
        message = (
            f"{name!r} is no name of a package; valid: small letters, digits, underscores, a letter first"
        )
        problems.append(Problem(message, package))
        return
    for kind in SECTIONS:
        for file in sorted((package / kind).glob(f"*.{kind}")):
            if not MESSAGE.fullmatch(file.stem):
                problems.append(Problem("no name of a type; valid: letters and digits, a letter first", file))
                continue
            try:
                if file.stat().st_size > _LARGEST:
                    raise ValueError("too large for a definition")
                text = read_text(file, _LARGEST)
            except (OSError, ValueError) as error:
                problems.append(Problem(f"cannot be read as UTF-8 text: {error}", file))
                continue
            yield Definition(f"{name}/{kind}/{file.stem}", text, file)


def _package_name(package: Path) -> str:
    manifest = package / "package.xml"
    if manifest.is_file():
        match = _PACKAGE_TAG.search(manifest.read_text(encoding="utf-8", errors="replace"))
        if match:
            return match[1]
    return package.name
