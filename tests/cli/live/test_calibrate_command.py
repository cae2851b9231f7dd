"""`twin calibrate`: what it prints and writes, and its troubles in one sentence."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.measures.calibration import record, room
from twin.scenario.schema import load


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("calibrate")
    record(room(folder), folder / "drive", 4, 18.0)
    return folder


def test_what_is_printed_and_written(folder: Path, invoke: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    code, out, _ = invoke("calibrate", "room.yaml", "drive", "-o", "calibrated.yaml")
    words = " ".join(out.split())
    assert code == 0
    assert "mm +1.98 %" in words
    assert "friction: not observable: no wheel slid" in words
    assert "held out: 6 of 18 s, 5 s ahead before after" in words
    assert """patch: --set 'faults=[{"wheel_radius": {"factor": 0.9""" in words
    assert Path("calibrated.yaml").read_text("utf-8").startswith("# Calibrated by drive.\nname: room\n")
    assert [entry.kind for entry in load("calibrated.yaml").faults] == ["wheel_radius", "track", "latency"]

    code, out, _ = invoke("calibrate", "calibrated.yaml", "drive", "--json")
    values = json.loads(out)
    low, high = values["estimates"]["track"]["interval"]
    assert low < values["estimates"]["track"]["value"] < high
    assert values["estimates"]["friction"]["not_observable"].startswith("no wheel slid")
    assert values["patch"] == load("calibrated.yaml").source.data["faults"]
    # The same patch again is no better.
    assert all(row["before"] == pytest.approx(row["after"]) for row in values["held_out"].values())


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["room.yaml", "nowhere"], "nowhere: cannot be read: No such file or directory"),
        (["room.yaml", "drive", "--robot", "x"], "scenario 'room' has no robot 'x'"),
        (["room.yaml", "drive", "-o", "."], "--output .: cannot be written: it is a folder; name a file"),
        (["room.yaml", "drive", "--set", "robots.0.pose.x=20"], "give its start with --set robots.0.pose"),
        (["room.yaml", "--live", "--robot", "x"], "scenario 'room' has no robot 'x'"),
        (["room.yaml", "--live", "--connect", "tcp/127.0.0.1:1"], "tcp/127.0.0.1:1"),
    ],
)
def test_trouble_is_one_sentence(
    folder: Path, invoke: Any, monkeypatch: pytest.MonkeyPatch, arguments: list[str], why: str
) -> None:
    monkeypatch.chdir(folder)
    code, out, err = invoke("calibrate", *arguments)
    assert (code, out) == (2, "")
    assert why in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        ([], "Invalid value for BAG: a bag, or --live instead of it"),
        (["drive", "--live"], "Invalid value for BAG: a bag, or --live instead of it"),
        (["drive", "--record", "own"], "Invalid value for --record: only --live records"),
        (["--live", "--for", "15"], "Invalid value for --for: 15: must be at least 16 s"),
    ],
)
def test_options_that_do_not_go_together_are_told(invoke: Any, arguments: list[str], why: str) -> None:
    code, out, err = invoke("calibrate", "diff_bot_figure8", *arguments)
    assert (code, out) == (2, "")
    assert why in " ".join(err.split())
