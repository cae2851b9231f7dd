"""`twin diff` and `twin run --golden`: exit codes as of diff, a table, JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

SCENARIO = """\
name: spurt
seed: 1
duration: 0.4 s
robots: [{model: diff_bot}]
mission: {type: velocity_profile, robot: diff_bot, steps: [{duration: 5 s, linear: 0.2 m/s}]}
checks: [{driven_distance: {min: 2 cm}}]
"""


@pytest.fixture
def spurt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "spurt.yaml"
    file.write_text(SCENARIO, encoding="utf-8")
    return file


def test_golden_and_diff_agree(spurt: Path, invoke: Any) -> None:
    assert invoke("run", spurt, "--no-record", "--out", "golden")[0] == 0

    code, out, _ = invoke("run", spurt, "--no-record", "--out", "same", "--golden", "golden")
    assert code == 0
    assert out.splitlines()[-1] == "SAME  one run, bit by bit"
    assert invoke("diff", "golden", "same")[0] == 0

    slower = ["run", spurt, "--no-record", "--out", "slower", "--set", "mission.steps.0.linear=0.199999"]
    code, out, _ = invoke(*slower, "--golden", "golden/hashes.json")
    assert code == 1
    assert "mission.steps.0.linear  0.2 m/s  0.199999" in out
    first = next(line.split() for line in out.splitlines() if line.startswith(" first"))
    assert first[1:3] + first[4:] == ["0.100", "s", "/cmd_vel", "linear.x", "0.2", "0.199999", "-1e-06"]
    assert out.splitlines()[-1] == f"DIFFERENT  first at 0.100 s, tick {first[3]}: /cmd_vel linear.x"

    code, out, _ = invoke("diff", "golden", "--set", "mission.steps.0.linear=0.199999", "--json")
    assert code == 1
    assert [json.loads(out)["first"][0][key] for key in ("tick", "topic", "field")] == [
        int(first[3]),
        "/cmd_vel",
        "linear.x",
    ]

    code, out, _ = invoke(*slower, "--golden", "golden", "--json")
    verdict = json.loads(out)
    assert (code, verdict["verdict"], verdict["golden"]["same"]) == (1, "pass", False)


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["diff", "nothing", "here"], "nothing: no folder of a run, and no scenario 'nothing'"),
        (["diff", "here"], "here/hashes.json: no such file; `twin run` writes it into the folder of a run"),
        (["diff", "spurt.yaml", "here", "--set", "seed=2"], "here: this run is over"),
        (["diff", "spurt.yaml", "--set", "sed=2"], "unknown key 'sed'"),
        (["run", "spurt.yaml", "--golden", "spurt.yaml"], "must be the folder of a run, or its hashes.json"),
        (["run", "spurt.yaml", "--golden", "here", "--repeat", "2"], "leave --repeat"),
    ],
)
def test_trouble_is_one_sentence(spurt: Path, invoke: Any, arguments: list[str], why: str) -> None:
    Path("here").mkdir()
    code, out, err = invoke(*arguments)
    assert (code, out) == (2, "")
    assert why in " ".join(err.replace("│", " ").split())
    assert not Path("runs").exists()


@pytest.mark.parametrize(
    "other", [["nothing"], ["here"], ["spurt.yaml", "--set", "sed=2"], ["--set", "sed=2"]]
)
def test_nothing_is_run_before_both_are_known(
    spurt: Path, invoke: Any, monkeypatch: pytest.MonkeyPatch, other: list[str]
) -> None:
    Path("here").mkdir()
    monkeypatch.setattr("twin.experiments.diff.side.OpenRun", None)
    assert invoke("diff", "spurt.yaml", *other)[0] == 2
