"""All scenarios that ship, in one run of `twin test`, and the report on it: as the README says."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]


def twin(*words: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "twin.cli", *words], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_all_pass_and_are_reported(tmp_path: Path) -> None:
    folder = tmp_path / "all"
    twin("test", "scenarios", "-j", "2", "--out", str(folder))
    folders = {path.name.partition("-")[2]: path for path in folder.iterdir() if path.is_dir()}
    assert set(folders) == {path.stem for path in (ROOT / "scenarios").glob("*.yaml")}

    def check(scenario: str, name: str) -> dict[str, Any]:
        verdict = json.loads((folders[scenario] / "verdict.json").read_text(encoding="utf-8"))
        assert verdict["verdict"] == "pass"
        return next(check for check in verdict["checks"] if check["name"].startswith(name))

    round_it = check("warehouse_blocked_aisle", "driven_distance")["value"]
    assert round_it > check("warehouse", "driven_distance")["value"] + 5.0, "another way"
    assert check("warehouse_blocked_aisle", "no_collision")["passed"]
    assert check("warehouse_lidar_lost", "mission_failed")["passed"]
    assert check("warehouse_kidnapped", "final_pose")["passed"]
    made = {path.name for path in folders["warehouse_slam"].iterdir()}
    assert {"map.yaml", "map.pgm", "map.posegraph"} <= made
    twin("report", str(folder))
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert [scenario for scenario in folders if scenario not in page] == []
