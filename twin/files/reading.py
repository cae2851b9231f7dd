"""Reading files that users name: nothing that never ends, and nothing that waits for somebody to write."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO

_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}
MOST_BYTES = 1 << 30
_CHUNK = 1 << 20


def refusal(path: str | Path) -> str | None:
    """Return why something is not to be opened: `it is a pipe, not a regular file`.

    A pipe without a name, which only who started this process can have given it, is to be: `/dev/stdin`, or
    the `/dev/fd/63` that shells write for `<(command)`.
    """
    try:
        mode = os.stat(path).st_mode
    except OSError:
        return None  # whoever opens it says what is wrong
    if stat.S_ISFIFO(mode) and not os.path.exists(os.path.realpath(path)):
        return None
    return None if stat.S_ISREG(mode) else f"it is {_KINDS.get(stat.S_IFMT(mode), 'odd')}, not a regular file"


def absence(path: Path) -> str:
    """Return why there is no such file to read, and which may have been meant; empty if that is not why."""
    from difflib import get_close_matches

    try:
        mode = path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        pass
    except OSError:
        return ""  # such as a name that is too long: whoever opens it says so
    else:
        return "is a folder; name a file" if stat.S_ISDIR(mode) else ""
    try:
        names = sorted(each.name for each in path.parent.iterdir() if each.is_file())
    except OSError:  # its folder is missing, too
        names = []
    like = get_close_matches(path.name, names, n=1, cutoff=0.7)
    return f"no such file; did you mean {path.parent / like[0]}?" if like else "no such file"


def open_file(path: Path) -> BinaryIO:
    """Open a file for reading.

    Raises:
        OSError: It cannot be read, or is a folder, pipe, socket or device, which is told at once.
    """
    why = refusal(path)
    if why is not None:
        raise OSError(errno.EINVAL, why, str(path))
    return path.open("rb")


def read_bytes(path: Path, most: int = MOST_BYTES) -> bytes:
    """Return the content of a file.

    Args:
        path: The file.
        most: The largest size [bytes].

    Raises:
        OSError: As by `open_file`, or it is larger.
    """
    with open_file(path) as stream:
        # As much as the file says to have and no more, as a buffer is made for all that is asked for.
        content = stream.read(min(most, os.fstat(stream.fileno()).st_size) + 1)
        while len(content) <= most and (more := stream.read(_CHUNK)):
            content += more  # it grows, or is one of /proc, which say that they have nothing
    if len(content) > most:
        raise OSError(errno.EFBIG, f"it has more than {most} bytes", str(path))
    return content


def read_text(path: Path, most: int = MOST_BYTES, *, errors: str = "strict") -> str:
    """Return the content of a UTF-8 file, with line feeds as ends of lines; see `read_bytes`.

    Raises:
        OSError: As by `read_bytes`.
        UnicodeDecodeError: It is not UTF-8.
    """
    text = read_bytes(path, most).decode("utf-8", errors)
    return text.replace("\r\n", "\n").replace("\r", "\n")
