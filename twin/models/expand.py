"""Expanding xacro in a guarded child process."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from twin.errors import ModelError, Problem
from twin.models.catalogue import ROBOTS

TIME_LIMIT_S = 15.0
WORKER = Path(__file__).with_name("xacro_worker.py")


def expand(
    source: Path,
    *,
    args: Mapping[str, str],
    packages: Mapping[str, Path],
    time_limit_s: float = TIME_LIMIT_S,
) -> str:
    """Return the URDF text of a xacro file.

    Args:
        source: The file.
        args: Values of `<xacro:arg>`, as `name:=value` on a ROS command line.
        packages: Folder of each ROS package that `$(find name)` may name.
        time_limit_s: Of the whole expansion [s, wall clock].

    Raises:
        ModelError: xacro refuses the file, or it takes too long.
    """
    request = {
        "file": str(source.resolve()),
        "args": dict(args),
        "packages": {name: str(path.resolve()) for name, path in packages.items()},
        "roots": [str(root.resolve()) for root in (source.parent, *packages.values())],
    }
    answer = _run_worker(request, source, time_limit_s)
    if "error" in answer:
        file = Path(answer["files"][-1]) if answer["files"] else source
        raise ModelError(
            Problem(f"xacro: {answer['error']}", source if _same(file, source) else file, code="xacro")
        )
    return answer["urdf"]


def _run_worker(request: Mapping[str, object], source: Path, time_limit_s: float) -> dict[str, Any]:
    # Isolated and with an empty environment: $(env ...) and PYTHON* variables do not reach into a model.
    command = [sys.executable, "-I", "-X", "utf8", str(WORKER)]
    try:
        done = subprocess.run(
            command,
            input=json.dumps(request),
            capture_output=True,
            encoding="utf-8",
            timeout=time_limit_s,
            env={},
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise ModelError(
            Problem(
                f"xacro did not finish within {time_limit_s:g} s; look for endless recursion",
                source,
                code="xacro",
            )
        ) from None
    if done.returncode != 0:
        reason = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
        raise ModelError(Problem(f"xacro failed: {reason[0]}", source, code="xacro"))
    return json.loads(done.stdout)


def known_packages(source: Path, given: Mapping[str, Path]) -> dict[str, Path]:
    """Return the ROS packages a model may name: its own (found by package.xml above it), twin's, the given.

    Raises:
        ModelError: A given folder does not exist.
    """
    missing = [name for name, path in given.items() if not path.is_dir()]
    if missing:
        raise ModelError(
            Problem(f"package '{name}': no such folder {given[name]}", code="no-package") for name in missing
        )
    found = {"twin_robots": ROBOTS}
    for folder in source.resolve().parents:
        if (folder / "package.xml").is_file():
            found[_package_name(folder)] = folder
            break
    return {**found, **given}


def _package_name(folder: Path) -> str:
    from lxml import etree

    parser = etree.XMLParser(resolve_entities=False, no_network=True, recover=True)
    root = etree.parse(str(folder / "package.xml"), parser).getroot()
    name = None if root is None else root.findtext("name")
    return (name or folder.name).strip()


def _same(a: Path, b: Path) -> bool:
    return a.resolve() == b.resolve()
