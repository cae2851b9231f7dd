"""`twin mutate`: what it prints, its exit codes, and its troubles in one sentence."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

SCENARIO = """\
name: spurt
seed: 1
duration: 1.2 s
robots: [{model: diff_bot}]
mission: {type: velocity_profile, robot: diff_bot, steps: [{duration: 5 s, linear: 0.2 m/s}]}
checks: [{driven_distance: {min: 0.1 m}}]
"""


@pytest.fixture
def spurt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "spurt.yaml"
    file.write_text(SCENARIO, encoding="utf-8")
    return file


def test_what_is_caught_and_what_is_not_is_told(spurt: Path, invoke: Any) -> None:
    names = ["mirrored_wheel", "swapped_wheels", "lidar_frame", "map_shifted"]
    chosen = [word for name in names for word in ("--mutant", name)]
    code, out, _ = invoke("mutate", "spurt.yaml", *chosen, "-j", "2", "--min-score", "0.5")
    lines = [line.strip() for line in out.splitlines()]
    assert code == 0
    assert [line.split("  ")[0] for line in lines[1:4]] == ["caught", "no effect", "survived"]
    assert lines[1].endswith("driven_distance")
    assert lines[4] == (
        "1 of 2 caught (50%); survived: lidar_frame; no effect: swapped_wheels; not here: map_shifted"
    )

    code, out, _ = invoke("mutate", "spurt.yaml", *chosen, "-j", "1", "--min-score", "0.51", "--json")
    report = json.loads(out)
    assert (code, report["score"], report["survived"]) == (1, 0.5, ["lidar_frame"])
    assert [each["mutant"] for each in report["mutants"]] == names


def test_all_mutants_are_listed_with_what_is_wrong(invoke: Any) -> None:
    code, out, _ = invoke("mutate", "--list")
    assert code == 0
    assert len(out.splitlines()) > 20
    assert "mirrored_wheel        The motors of the right wheels turn the wrong way." in out


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["spurt.yaml", "--mutant", "mirrored_weel"], "did you mean 'mirrored_wheel'?"),
        (["spurt.yaml", "--mutant", "gone.py:Mutant"], "gone.py"),
        (["--min-score", "0.9"], "name a scenario whose checks are to catch mutants"),
        (["nothing"], "no scenario 'nothing'"),
    ],
)
def test_trouble_is_one_sentence(spurt: Path, invoke: Any, arguments: list[str], why: str) -> None:
    code, out, err = invoke("mutate", *arguments, "-j", "1")
    assert (code, out) == (2, "")
    assert why in " ".join(err.split())
