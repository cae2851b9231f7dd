"""From the name of a file in a robot's text, such as `package://my_robot/meshes/arm.stl`, to the file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from twin.models.urdf.packages import Packages, unknown_package

_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]+):(.*)", re.DOTALL)


@dataclass(frozen=True, kw_only=True)
class Resource:
    """A file that a robot's text names, or why it may not be used."""

    path: Path | None = None
    """An existing file."""
    code: str = ""
    """Without a path: `missing-mesh` or `outside-path`."""
    reason: str = ""
    """Without a path: the end of a sentence that begins with the name."""


def locate(reference: str, source: Path, packages: Packages) -> Resource:
    """Return the file that `reference` names in the robot file `source`.

    It is a path relative to `source`, or begins with `package://NAME/`, `model://NAME/` (some exporters write
    a third slash) or `file://`. Only files in the folder of `source` and in packages are found: a robot
    file from the internet shall not copy other files into what is made of it.
    """
    path = _path(reference, source, packages)
    if isinstance(path, Resource):
        return path
    try:
        if not path.is_file():
            return Resource(code="missing-mesh", reason="does not exist")
        if not packages.allows(path):
            trust = f"if you trust it, give --allow-path {path.resolve().parent}"
            reason = f"is outside of the file's folder and packages; {trust}"
            return Resource(code="outside-path", reason=reason)
        return Resource(path=path)
    except (OSError, ValueError):
        return Resource(code="missing-mesh", reason="is no name of a file")


def _path(reference: str, source: Path, packages: Mapping[str, Path]) -> Path | Resource:
    found = _SCHEME.fullmatch(reference)
    if found is None:
        return source.parent / reference
    scheme, rest = found[1].lower(), found[2]
    if scheme in ("package", "model"):
        name, _, inside = rest.lstrip("/").partition("/")
        folder = packages.get(name)
        if folder is None:
            reason = f"does not exist; no package '{name}'; {unknown_package(name, packages)}"
            return Resource(code="missing-mesh", reason=reason)
        return folder / inside.lstrip("/")
    if scheme == "file":
        return source.parent / rest.removeprefix("//")
    return Resource(code="missing-mesh", reason="is no local file; give a path, package:// or file://")
