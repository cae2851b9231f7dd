"""What xacro made of a file is kept, and nothing that it was made of can change unseen."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from twin.errors import ModelError
from twin.files.kept import VARIABLE
from twin.models import ReadOptions
from twin.models.expansion import expand as module
from twin.models.expansion.expand import expand

HEAD = "<robot name='r' xmlns:xacro='http://www.ros.org/wiki/xacro'>"


class Robot:
    """A xacro file with all that can change what becomes of it."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "model" / "r.urdf.xacro"
        self.part = folder / "model" / "part.xacro"
        self.numbers = folder / "model" / "numbers.yaml"
        self.package = folder / "parts"
        self.options = ReadOptions(args={"n": "base"}, allow_env=("TWIN_TEST_SIZE",))
        for name in ("model", "parts"):
            folder.joinpath(name).mkdir()
            text = f"<package><name>{name}</name></package>"
            folder.joinpath(name, "package.xml").write_text(text, "utf-8")
        self.part.write_text(f"{HEAD}<link name='part'/></robot>", "utf-8")
        self.package.joinpath("other.xacro").write_text(f"{HEAD}<link name='other'/></robot>", "utf-8")
        self.numbers.write_text("{size: 3}", "utf-8")
        self.write()

    def write(self, more: str = "") -> None:
        body = (
            "<xacro:arg name='n' default='a'/><link name='$(arg n)'/><xacro:include filename='part.xacro'/>"
        )
        body += "<xacro:include filename='maybe.xacro' optional='true'/>"
        body += "<xacro:include filename='$(find parts)/other.xacro'/>"
        body += '<link name=\'${load_yaml("numbers.yaml")["size"]}$(optenv TWIN_TEST_SIZE none)\'/>'
        self.file.write_text(f"{HEAD}{body}{more}</robot>", "utf-8")


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Robot:
    monkeypatch.setenv(VARIABLE, str(tmp_path / "cache"))
    return Robot(tmp_path)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Mapping[str, Any]]:
    """What the process is asked that expands."""
    requests: list[Mapping[str, Any]] = []
    run = module._run_worker

    def told(request: Mapping[str, object], source: Path, time_limit_s: float) -> dict[str, Any]:
        requests.append(request)
        return run(request, source, time_limit_s)

    monkeypatch.setattr(module, "_run_worker", told)
    return requests


def test_the_second_time_no_process_is_started(robot: Robot, asked: list[Any]) -> None:
    first = expand(robot.file, robot.options)
    assert "'part'" in first.urdf.replace('"', "'")
    assert expand(robot.file, robot.options) == first
    assert len(asked) == 1


CHANGES: dict[str, Callable[[Robot, pytest.MonkeyPatch], object]] = {
    "the file": lambda robot, _: robot.write("<link name='more'/>"),
    "a file that is included": lambda robot, _: robot.part.write_text(
        f"{HEAD}<link name='piece'/></robot>", "utf-8"
    ),
    "a file of a package": lambda robot, _: robot.package.joinpath("other.xacro").write_text(
        f"{HEAD}<link name='piece'/></robot>", "utf-8"
    ),
    "numbers that are read": lambda robot, _: robot.numbers.write_text("{size: 4}", "utf-8"),
    "the environment that it may read": lambda robot, patch: patch.setenv("TWIN_TEST_SIZE", "9"),
    "a file that was missing": lambda robot, _: robot.file.with_name("maybe.xacro").write_text(
        f"{HEAD}<link name='found'/></robot>", "utf-8"
    ),
}


def test_a_change_of_what_it_was_made_of_is_seen(
    robot: Robot, asked: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    before = expand(robot.file, robot.options)
    for count, (what, change) in enumerate(CHANGES.items(), 2):
        change(robot, monkeypatch)
        after = expand(robot.file, robot.options)
        assert after.urdf != before.urdf, what
        assert len(asked) == count, what
        before = after


def test_other_arguments_are_another_robot(robot: Robot, asked: list[Any]) -> None:
    expand(robot.file, robot.options)
    other = expand(robot.file, ReadOptions(args={"n": "body"}))
    assert 'name="body"' in other.urdf
    assert len(asked) == 2


def test_a_package_that_is_found_elsewhere_is_another(robot: Robot, asked: list[Any], tmp_path: Path) -> None:
    expand(robot.file, robot.options)
    moved = tmp_path / "moved"
    robot.package.rename(moved)
    assert 'name="other"' in expand(robot.file, robot.options).urdf
    assert len(asked) == 2


def test_files_found_by_a_pattern_are_looked_for_again(robot: Robot, asked: list[Any]) -> None:
    robot.write("<xacro:include filename='more_*.xacro'/>")
    expand(robot.file, robot.options)
    robot.file.with_name("more_1.xacro").write_text(f"{HEAD}<link name='more'/></robot>", "utf-8")
    assert 'name="more"' in expand(robot.file, robot.options).urdf
    assert len(asked) == 2


def test_faults_are_not_kept(robot: Robot, asked: list[Any]) -> None:
    robot.write("<xacro:nothing/>")
    for _ in range(2):
        with pytest.raises(ModelError, match="nothing"):
            expand(robot.file, robot.options)
    assert len(asked) == 2


def test_an_answer_that_somebody_spoiled_is_asked_for_again(robot: Robot, asked: list[Any]) -> None:
    first = expand(robot.file, robot.options)
    (file,) = (robot.file.parents[1] / "cache").rglob("*.json")
    file.write_text('{"read": {}, "urdf": 3}', "utf-8")
    assert expand(robot.file, robot.options) == first
    assert len(asked) == 2
