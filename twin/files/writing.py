"""Files and folders that commands write: whole or not at all, and each folder by one process at a time."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from twin.errors import RecordingError

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
LOCK = ".lock"
"""In a folder that is being written; holds the id of the process."""


def check_file(path: Path, option: str = "--output") -> None:
    """Refuse, before any work, a file that could not be written at its end; its folder may be missing.

    Raises:
        RecordingError: It is a folder or has one that cannot be made or written.
    """
    fault = _fault(path)
    if fault:
        raise RecordingError(f"{option} {path}: cannot be written: {fault}")


def _fault(path: Path) -> str:
    try:
        with suppress(FileNotFoundError, NotADirectoryError):
            path.stat()  # a loop of links or a name that is too long
        if path.is_dir():
            return "it is a folder; name a file"
        if path.exists():
            return "" if os.access(path, os.W_OK) else "it is read-only; name another file"
        folder = next(each for each in path.absolute().parents if os.path.lexists(each))
    except OSError as error:
        return error.strerror or str(error)
    if not folder.is_dir():
        return f"{folder} is not a folder; name another place"
    return "" if os.access(folder, os.W_OK | os.X_OK) else f"the folder {folder} is read-only; name another"


def write_whole(path: Path, content: bytes | str) -> None:
    """Write a file so that no reader ever sees a part of it; its folder is made, links are followed.

    Raises:
        RecordingError: The file cannot be written; then what was there before is there still.
    """
    data = content.encode() if isinstance(content, str) else content
    try:
        if path.exists() and not path.is_file() and not path.is_dir():
            path.write_bytes(data)  # such as /dev/stdout, which is not to be replaced
        else:
            with replaced(path) as new:
                new.write_bytes(data)
    except OSError as fault:
        raise RecordingError(f"{path}: cannot be written: {fault.strerror or fault}") from fault


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """Yield an empty file that takes the place of `path` when the block ends, and goes if it fails.

    Raises:
        OSError: It cannot be made or put there.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    target = Path(os.path.realpath(path))
    descriptor, name = tempfile.mkstemp(f"{target.suffix[:20]}", f".{target.stem[:100]}.", target.parent)
    os.close(descriptor)
    new = Path(name)
    try:
        yield new
        new.chmod(0o644)  # mkstemp's 0600 would lock out a CI server's other user
        new.replace(target)
    except BaseException:
        new.unlink(missing_ok=True)
        raise


def is_full(fault: BaseException) -> bool:
    """Tell whether what could not be written, for which an error stands, found no room."""
    cause = fault.__cause__ or fault
    return isinstance(cause, OSError) and cause.errno in _NO_ROOM


def make_folder(path: Path) -> Path:
    """Make a folder for results, unless it is there; raises RecordingError where that cannot be."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        raise RecordingError(f"{path}: cannot be the folder of the results: {fault.strerror}") from fault
    return path


@contextmanager
def written_alone(folder: Path) -> Iterator[None]:
    """Keep other processes of twin from writing into a folder, which is there, during the block.

    The kernel drops the lock when this process ends, however it does: a file that was left means nothing.

    Raises:
        RecordingError: Another process is writing there, or this one cannot.
    """
    file = folder / LOCK
    try:
        descriptor = _locked(file)
        os.pwrite(descriptor, b"%d" % os.getpid(), 0)
    except OSError as fault:
        raise RecordingError(f"{folder}: cannot be written: {fault.strerror}; name another folder") from fault
    try:
        yield
    finally:
        file.unlink(missing_ok=True)
        os.close(descriptor)


def _locked(file: Path) -> int:
    """Return the descriptor of a lock file that is there and this process's."""
    import fcntl

    while True:
        descriptor = os.open(file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            process = os.pread(descriptor, 20, 0).decode(errors="replace")
            os.close(descriptor)
            raise RecordingError(
                f"{file.parent}: process {process or '(just starting)'} is writing there; "
                "wait for its end, or name another folder"
            ) from None
        except OSError:
            return descriptor  # this file system has no locks
        if file.exists() and os.path.samestat(os.fstat(descriptor), file.stat()):
            os.ftruncate(descriptor, 0)
            return descriptor
        os.close(descriptor)  # its owner, who has just ended, has removed it
