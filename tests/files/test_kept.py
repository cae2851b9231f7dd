"""What is kept for later is whole, or as if it had never been."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.files import kept as module
from twin.files.kept import VARIABLE, keep, kept


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    return tmp_path


def test_a_value_is_found_by_its_kind_and_key(folder: Path) -> None:
    keep("tree", "a", {"size": [1, 2]})
    keep("tree", "b", "other")
    assert kept("tree", "a") == {"size": [1, 2]}
    assert kept("tree", "c") is None
    assert kept("house", "a") is None


@pytest.mark.parametrize("broken", [b"", b'{"size": [1', b"\xff\xfe", b"[" * 100_000])
def test_a_broken_file_is_no_value_and_is_replaced(folder: Path, broken: bytes) -> None:
    keep("tree", "a", 1)
    (file,) = (folder / "tree").iterdir()
    file.write_bytes(broken)
    assert kept("tree", "a") is None
    keep("tree", "a", 2)
    assert kept("tree", "a") == 2


def test_a_folder_that_cannot_be_written_keeps_nothing(folder: Path) -> None:
    (folder / "tree").write_text("a file where a folder should be", encoding="utf-8")
    keep("tree", "a", 1)
    assert kept("tree", "a") is None


def test_off_writes_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    monkeypatch.setenv(VARIABLE, "off")
    keep("tree", "a", 1)
    assert kept("tree", "a") is None
    assert list(folder.iterdir()) == []


def test_the_users_own_folder_is_the_default(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE)
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    keep("tree", "a", 1)
    assert [file.parent.name for file in (folder / "twin").rglob("*.json")] == ["tree"]


def test_the_oldest_go_first(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST", 3)
    for number in range(6):
        keep("tree", str(number), number)
        for file in (folder / "tree").iterdir():  # as if a second had passed
            stat = file.stat()
            module.os.utime(file, ns=(stat.st_atime_ns, stat.st_mtime_ns - 1_000_000_000))
    assert [kept("tree", str(number)) for number in range(6)] == [None, None, None, 3, 4, 5]
