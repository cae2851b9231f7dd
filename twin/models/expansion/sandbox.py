"""What the process that expands xacro gives up: other folders, writing, programs, endless time."""

from __future__ import annotations

import contextlib
import os
import resource
import sys
from typing import Any

from twin.files.kept import hash_of
from twin.files.reading import refusal
from twin.models.urdf.packages import MANIFEST, Packages

CPU_SECONDS = 15
ADDRESS_SPACE_BYTES = 1 << 30
ANSWER_BYTES = 1 << 28
"""The process writes nothing but its answer."""
FORBIDDEN_EVENTS = ("socket.", "subprocess.", "os.", "shutil.", "ctypes.", "urllib.", "webbrowser.", "pty.")
HARMLESS_EVENTS = ("os.listdir", "os.scandir", "os.walk", "os.fwalk", "os.putenv", "os.unsetenv")
MODULES = (".py", ".pyc", ".so")


class Refused(Exception):
    """The file tried what a model file may not do."""

    def __init__(
        self, message: str, *, code: str = "xacro", file: str | None = None, line: int | None = None
    ) -> None:
        super().__init__(message)
        self.code = code
        self.file = file
        self.line = line


def limit_resources() -> None:
    """Limit time, memory, the answer's size, processes and open files of this process, for good."""
    limits = {
        resource.RLIMIT_CPU: CPU_SECONDS,
        resource.RLIMIT_AS: ADDRESS_SPACE_BYTES,
        resource.RLIMIT_FSIZE: ANSWER_BYTES,
        resource.RLIMIT_CORE: 0,
        resource.RLIMIT_NPROC: 0,
        resource.RLIMIT_NOFILE: 128,
    }
    for kind, most in limits.items():
        # Not every system knows every limit, and the user's own may be lower.
        with contextlib.suppress(OSError, ValueError):
            # At the hard limit of time a process is killed without a reason: it comes a second later.
            resource.setrlimit(kind, (most, most + 1 if kind == resource.RLIMIT_CPU else most))


def refuse_outside(name: str, packages: Packages) -> None:
    """Refuse to open a file that is not in the robot file's folder, a package or an allowed folder.

    Raises:
        Refused: It is elsewhere.
    """
    if not packages.allows(name):
        folder = os.path.dirname(os.path.realpath(name))
        raise Refused(
            f"the file opens '{name}', which is outside of its own folder and packages; "
            f"if you trust it, give --allow-path {folder}",
            code="outside-path",
        )


class Reading:
    """What a model file had this process read."""

    def __init__(self) -> None:
        self.files: dict[str, str | None] = {}
        """Hashes by path; None: there was no such file."""
        self.by_pattern = False
        """Whether files were looked for by a pattern."""

    def take(self, name: str) -> None:
        """Take note of a file before it is opened."""
        if name not in self.files:
            self.files[name] = None  # to take its hash opens it, too
            self.files[name] = hash_of(name)

    def is_repeatable(self) -> bool:
        """Whether the same files would be read again, which no one has changed meanwhile."""
        same = all(hash_of(name) == was and os.path.isabs(name) for name, was in self.files.items())
        return same and not self.by_pattern


def close_the_door(packages: Packages) -> Reading:
    """Let this process read only what `packages` allows, write nothing and start nothing, for good.

    Returns:
        What is read from then on.
    """
    reading = Reading()
    interpreter = tuple(
        os.path.realpath(folder) + os.sep for folder in (sys.prefix, sys.base_prefix, *sys.path) if folder
    )

    def is_of_interpreter(real: str) -> bool:
        if os.path.basename(real) == MANIFEST:  # read to find packages
            return True
        return real.endswith(MODULES) and real.startswith(interpreter)

    def guard(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            path, _, flags = arguments
            if isinstance(path, int):
                return
            name = os.fsdecode(path)
            if isinstance(flags, int) and flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT):
                raise Refused(f"the file writes '{name}', which a model file may not do")
            is_ours = is_of_interpreter(os.path.realpath(name))
            if not is_ours:
                refuse_outside(name, packages)
            why = None if os.path.isdir(name) else refusal(name)
            if why is not None:
                raise Refused(f"the file opens '{name}': {why}")
            if not is_ours:
                reading.take(name)
        elif event == "glob.glob":
            reading.by_pattern = True
        elif event.startswith(FORBIDDEN_EVENTS) and event not in HARMLESS_EVENTS:
            raise Refused(f"the file tries '{event}', which a model file may not do")

    sys.addaudithook(guard)
    return reading
