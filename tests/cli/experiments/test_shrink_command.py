"""`twin shrink`: what it prints and writes, and its troubles in one sentence."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

SCENARIO = """\
name: spurt
seed: 1
duration: 0.6 s
robots: [{model: diff_bot, command_latency: 20 ms}]
mission: {type: velocity_profile, robot: diff_bot, steps: [{duration: 5 s, linear: 0.2 m/s}]}
faults: [{odometry_jump: {at: 0.2 s, distance: 20 cm}}]
checks: [{driven_distance: {min: 5 cm}}, {odometry_drift: {max: 1 cm}}]
"""


@pytest.fixture
def spurt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "spurt.yaml"
    file.write_text(SCENARIO, encoding="utf-8")
    return file


def test_the_smallest_scenario_is_written_and_told(spurt: Path, invoke: Any) -> None:
    code, out, _ = invoke("shrink", "spurt.yaml", "--set", "description=x", "-j", "1")
    assert code == 0
    words = " ".join(out.split())
    assert "left faults.0 odometry_jump" in words
    assert "removed checks.0 driven_distance --set description=x robots.0.command_latency: 20 ms" in words
    text = Path("spurt_shrunk.yaml").read_text("utf-8")
    assert text.startswith(
        "# Shrunk from spurt.yaml: the smallest that still fails odometry_drift.\n# Its reason: "
    )
    assert "- odometry_jump: {at: 0.2 s, distance: 20 cm}\n" in text

    code, out, _ = invoke("shrink", "spurt_shrunk.yaml", "-o", "again.yaml", "--json", "-j", "1")
    values = json.loads(out)
    assert (code, values["removed"], values["left"]) == (0, [], ["faults.0 odometry_jump"])
    assert Path("again.yaml").read_text("utf-8").splitlines()[2:] == text.splitlines()[2:]
    code, out, _ = invoke("run", "again.yaml", "--no-record")
    assert (code, "FAIL  odometry_drift" in " ".join(out.split("\n")[2:3])) == (1, True)


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["spurt.yaml", "--set", "faults.0.odometry_jump.distance=x"], "must be a number"),
        (["spurt.yaml", "-o", "."], "--output .: cannot be written: it is a folder; name a file"),
        (["nothing"], "no scenario 'nothing'"),
    ],
)
def test_trouble_is_one_sentence(spurt: Path, invoke: Any, arguments: list[str], why: str) -> None:
    code, out, err = invoke("shrink", *arguments, "-j", "1")
    assert (code, out) == (2, "")
    assert why in " ".join(err.split())
    assert not Path("spurt_shrunk.yaml").exists()
