"""The child process that expands one xacro file; it is run as a script and imports nothing of twin.

xacro evaluates Python expressions of the file behind a guard that can be escaped. So the process itself gives
up what a model file has no business with: other folders, writing, sockets, programs.
It reads a JSON request on stdin, writes a JSON answer on stdout.
"""

from __future__ import annotations

import contextlib
import json
import os
import resource
import sys
from typing import Any

CPU_SECONDS = 15
ADDRESS_SPACE_BYTES = 1 << 30
FORBIDDEN_EVENTS = ("socket.", "subprocess.", "os.", "shutil.", "ctypes.", "glob.", "urllib.", "webbrowser.")
HARMLESS_EVENTS = ("os.listdir", "os.scandir", "os.walk", "os.fwalk", "os.putenv", "os.unsetenv")


class Refused(Exception):
    """The file tried what a model file may not do."""


def main() -> None:
    """Expand the requested file and answer with its text, or with what went wrong and in which files."""
    request = json.load(sys.stdin)
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS))
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE_BYTES, ADDRESS_SPACE_BYTES))
    with contextlib.redirect_stdout(sys.stderr):
        answer = _expand(request)
    json.dump(answer, sys.stdout)


def _expand(request: dict[str, Any]) -> dict[str, Any]:
    import xacro
    import xacro.substitution_args as substitution

    packages: dict[str, str] = request["packages"]

    def find(package: str) -> str:
        if package in packages:
            return packages[package]
        known = ", ".join(sorted(packages)) or "none"
        raise Refused(
            f"$(find {package}): package not found; known packages: {known} (give --package {package}=PATH)"
        )

    substitution._eval_find = find
    substitution._eval_dict["find"] = find
    _close_the_door(request["roots"])
    try:
        document = xacro.process_file(request["file"], mappings=request["args"])
        # Without xacro's banner: it holds the file's path, and the text is published and part of digests.
        return {"urdf": '<?xml version="1.0"?>' + document.documentElement.toxml()}
    except RecursionError:
        message = "a macro or include calls itself without end"
    except MemoryError:
        message = "the expansion needs more memory than a model file may use"
    except Exception as error:  # every fault of the file, whatever its type, is the user's to read
        message = " ".join(str(error).split()) or repr(error)
    return {"error": message, "files": [name for name in xacro.filestack or () if name]}


def _close_the_door(roots: list[str]) -> None:
    readable = tuple(os.path.realpath(root) + os.sep for root in [*roots, sys.prefix, sys.base_prefix])

    def guard(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            path, _, flags = arguments
            writes = isinstance(flags, int) and flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
            if isinstance(path, int):
                return
            real = os.path.realpath(os.fsdecode(path))
            if writes or not real.startswith(readable):
                raise Refused(
                    f"the file opens '{os.fsdecode(path)}', which is outside of its own folder and packages"
                )
        elif event.startswith(FORBIDDEN_EVENTS) and event not in HARMLESS_EVENTS:
            raise Refused(f"the file tries '{event}', which a model file may not do")

    sys.addaudithook(guard)


if __name__ == "__main__":
    main()
