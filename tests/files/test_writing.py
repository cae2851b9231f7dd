"""Files are written whole or not at all, and a folder by one process at a time."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from twin.errors import RecordingError
from twin.files.reading import absence
from twin.files.writing import check_file, replaced, write_whole, written_alone

_HOLDER = """
import pathlib, sys
from twin.files.writing import written_alone
with written_alone(pathlib.Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_a_failed_write_leaves_the_old_file_and_no_litter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "verdict.json"
    write_whole(file, b"old")

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(RecordingError, match=rf"{file}: cannot be written: No space left on device"):
        write_whole(file, b"new")
    monkeypatch.undo()
    assert file.read_bytes() == b"old"
    with pytest.raises(KeyboardInterrupt), replaced(file):
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == [file]


def test_folders_are_made_links_are_followed_and_devices_stay(tmp_path: Path) -> None:
    target, link, pipe = tmp_path / "new" / "deep" / "a.txt", tmp_path / "link", tmp_path / "pipe"
    write_whole(target, "1")
    link.symlink_to(target)
    assert target.stat().st_mode & 0o777 == 0o644  # whatever mkstemp makes: a CI server is another user
    write_whole(link, "2")
    assert (link.is_symlink(), target.read_text("utf-8")) == (True, "2")
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_whole(pipe, "3")  # and not a file in its place: /dev/null would be lost
    assert (pipe.is_fifo(), os.read(reader, 9)) == (True, b"3")
    os.close(reader)


def test_a_file_that_is_not_there_suggests_the_one_that_is(tmp_path: Path) -> None:
    file = tmp_path / "warehouse.yaml"
    file.touch()
    assert absence(file) == ""
    assert absence(tmp_path) == "is a folder; name a file"
    for name in ("warehous.yaml", "warehouse"):
        assert absence(tmp_path / name) == f"no such file; did you mean {file}?"
    assert absence(tmp_path / "other.yaml") == absence(tmp_path / "no" / "warehouse.yaml") == "no such file"
    assert absence(tmp_path / ("a" * 300)) == ""  # no name of a file at all, which is another fault


def test_what_cannot_be_written_is_known_before_the_work(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    for good in (file, tmp_path / "new", tmp_path / "new" / "deep" / "file", Path(os.devnull)):
        check_file(good)
    long, loop = tmp_path / ("a" * 300), file.with_name("loop")
    loop.symlink_to(loop)
    for path, why in (
        (tmp_path, "it is a folder; name a file"),
        (file / "in", f"{file} is not a folder; name another place"),
        (file / "in" / "deep", f"{file} is not a folder; name another place"),
        (long, "File name too long"),
        (loop, "Too many levels of symbolic links"),
    ):
        with pytest.raises(RecordingError) as fault:
            check_file(path, "--junit")
        assert str(fault.value) == f"--junit {path}: cannot be written: {why}"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["file", "loop"]


@pytest.mark.parametrize("denied", ["file", "folder"])
def test_a_read_only_place_is_known_before_the_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, denied: str
) -> None:
    """Tests may run as root, whom nothing is denied but a read-only file system."""
    monkeypatch.setattr("os.access", lambda path, mode: False)
    file = tmp_path / "file"
    if denied == "file":
        file.touch()
    with pytest.raises(RecordingError, match="read-only; name another"):
        check_file(file)


def test_a_folder_is_written_by_one_process_at_a_time(tmp_path: Path) -> None:
    """The lock goes with its process, however that ends."""
    command = [sys.executable, "-c", _HOLDER, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(RecordingError) as refused, written_alone(tmp_path):
            pass
        assert str(refused.value) == (
            f"{tmp_path}: process {holder.pid} is writing there; wait for its end, or name another folder"
        )
        holder.send_signal(signal.SIGKILL)
    assert (tmp_path / ".lock").exists()
    with (
        written_alone(tmp_path),
        pytest.raises(RecordingError, match=str(os.getpid())),
        written_alone(tmp_path),
    ):
        pass
    assert not any(tmp_path.iterdir())


def test_a_file_system_without_locks_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def flock(descriptor: int, how: int) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))  # as NFS without its lock service

    monkeypatch.setattr("fcntl.flock", flock)
    with written_alone(tmp_path):
        assert (tmp_path / ".lock").exists()
    assert not any(tmp_path.iterdir())


def test_a_lock_that_is_removed_while_another_process_opens_it_is_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import fcntl

    real, seen = fcntl.flock, []

    def flock(descriptor: int, how: int) -> None:
        if not seen:
            (tmp_path / ".lock").unlink()  # its owner has ended, between the two calls here
        seen.append(descriptor)
        real(descriptor, how)

    monkeypatch.setattr("fcntl.flock", flock)
    with written_alone(tmp_path):
        assert len(seen) == 2
        with pytest.raises(RecordingError), written_alone(tmp_path):
            pass
