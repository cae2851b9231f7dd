"""A new project: complete, of its own name, and nothing of it if it cannot be written."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest

from twin.convert.inspection import inspect_file
from twin.errors import RecordingError, TwinError
from twin.project import create
from twin.runtime import run
from twin.scenario import schema


def files(folder: Path) -> set[str]:
    return {file.relative_to(folder).as_posix() for file in folder.rglob("*") if file.is_file()}


def test_a_project_has_everything_under_its_own_name(tmp_path: Path) -> None:
    create(tmp_path / "rover")
    assert files(tmp_path / "rover") == {
        ".github/workflows/test.yml",
        ".gitignore",
        "README.md",
        "pyproject.toml",
        "rover/__init__.py",
        "rover/checks.py",
        "rover/rover.urdf.xacro",
        "rover/rover_hall.yaml",
        "scenarios/rover.yaml",
    }
    texts = [file.read_text("utf-8") for file in (tmp_path / "rover").rglob("*") if file.is_file()]
    assert not any("my_robot" in text for text in texts)
    assert {path.stat().st_mode & 0o777 for path in (tmp_path / "rover").rglob("*.*")} <= {0o644, 0o755}


def test_its_robot_has_no_faults_and_its_scenario_can_be_run(tmp_path: Path) -> None:
    create(tmp_path / "rover")
    assert inspect_file(tmp_path / "rover" / "rover" / "rover.urdf.xacro").diagnostics == ()
    scenario = schema.load(
        tmp_path / "rover" / "scenarios" / "rover.yaml", {"duration": "200 ms"}, execute=True
    )
    verdict = run(scenario)
    assert verdict.error is None
    assert verdict.checks[-1].reason == "the robot came no nearer to (3.0, -2.0) than 6.00 m"


@pytest.mark.parametrize("name", ["Rover", "r", "2wheels", "my-robot", "a__b", "my robot", "röver"])
def test_a_name_that_is_none_of_a_ros_package_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(TwinError, match=f"'{name}' is no name of a project; valid are .* such as my_robot"):
        create(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["twin", "json", "class", "scenarios"])
def test_a_name_that_hides_a_module_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(TwinError, match=f"such as {name}_robot is free"):
        create(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_not_empty_stays_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "rover").mkdir()
    (tmp_path / "rover" / "mine.txt").touch()
    (tmp_path / "buggy").write_text("mine", encoding="utf-8")
    with pytest.raises(RecordingError, match="rover: the folder is not empty; name a new one"):
        create(tmp_path / "rover")
    with pytest.raises(RecordingError, match="buggy: is no folder; name a new one"):
        create(tmp_path / "buggy")
    assert files(tmp_path) == {"rover/mine.txt", "buggy"}


def test_an_empty_folder_is_filled_and_may_be_the_current_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "rover").mkdir()
    monkeypatch.chdir(tmp_path / "rover")
    create(Path())
    assert Path("scenarios/rover.yaml").is_file()
    assert [path.name for path in tmp_path.iterdir()] == ["rover"]


def test_nothing_is_left_of_a_project_that_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = Path.write_text

    def full(path: Path, text: str, **options: str) -> int:
        if path.name == "pyproject.toml":
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(path, text, **options)

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(RecordingError, match=r"rover: cannot be written: No space left on device"):
        create(tmp_path / "rover")
    assert list(tmp_path.iterdir()) == []
