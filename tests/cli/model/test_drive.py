"""twin check --drive and the drive of twin convert: table, words, JSON, exit codes."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from twin.models import load

Invoke = Callable[..., tuple[int, str, str]]


@pytest.fixture
def mirrored(tmp_path: Path) -> Path:
    """The file of diff_bot with its right wheel's axis turned around."""
    before, joint, after = load("diff_bot").urdf.partition('<joint name="wheel_right_joint"')
    file = tmp_path / "mirrored.urdf"
    file.write_text(before + joint + after.replace("0 1 0", "0 -1 0", 1), encoding="utf-8")
    return file


def test_a_robot_that_drives_true(invoke: Invoke) -> None:
    code, out, err = invoke("check", "sp1s", "--drive")
    assert (code, err) == (0, "")
    lines = [line.split() for line in out.splitlines()]
    assert ["ok", "straight", "5", "m"] in [line[:4] for line in lines]
    assert not [line for line in lines if line[:1] == ["FAIL"]]
    assert "with equal loads 1.8444" in out


def test_a_mirrored_wheel_is_named_and_driven(invoke: Invoke, mirrored: Path) -> None:
    code, out, _ = invoke("check", mirrored, "--drive")
    assert code == 1
    assert "warning[drive-mismatch]" in out
    assert "error[drive]: straight 5 m: drives " in out
    assert "error[drive]: spin 360 degrees left: turns " in out
    assert invoke("check", mirrored)[0] == 0


def test_json_has_the_numbers(invoke: Invoke, mirrored: Path) -> None:
    code, out, _ = invoke("check", mirrored, "--drive", "--json")
    drive = json.loads(out)["drive"]
    assert (code, drive["passed"], drive["guessed"], drive["kind"]) == (1, False, False, "diff_drive")
    straight = drive["manoeuvres"][0]
    assert (straight["name"], straight["bar"], straight["unit"]) == ("straight 5 m", 0.005, "m")
    assert straight["error"] > 1.0
    assert "drive" not in json.loads(invoke("check", mirrored, "--json")[1])


def test_nothing_to_drive(invoke: Invoke) -> None:
    code, out, err = invoke("check", "r2d2", "--drive")
    assert code == 2
    assert "(7 links, 6 joints)" in out, "what was found is told all the same"
    assert json.loads(invoke("check", "r2d2", "--drive", "--json")[1])["robot"] == "r2d2"
    assert "robot 'r2d2' has no drive to check: the file has no drive plugin, nor wheels" in err


def test_conversion_drives_what_it_wrote(invoke: Invoke, mirrored: Path, tmp_path: Path) -> None:
    code, out, _ = invoke("convert", mirrored, "-o", tmp_path / "out")
    report = json.loads((tmp_path / "out" / "report.json").read_text("utf-8"))
    assert code == 0
    assert "does not drive as its plugin says: drives " in out
    assert not report["self_check"]["drive"]["passed"]
    assert invoke("convert", mirrored, "-o", tmp_path / "fixed", "--base", "fixed")[0] == 0
    report = json.loads((tmp_path / "fixed" / "report.json").read_text("utf-8"))
    assert "drive" not in report["self_check"]
