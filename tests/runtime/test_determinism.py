"""The same run twice is the same run."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from twin import runtime
from twin.scenario.schema import load
from twin.scenario.verdict import Verdict

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def outcome(*, seed: int = 1, **options: object) -> Verdict:
    scenario = load(SCENARIOS / "diff_bot_figure8.yaml", {"seed": str(seed), "duration": "4 s"})
    return runtime.run(scenario, **options)  # type: ignore[arg-type]


def digest(tmp_path: Path, *, seed: int = 1, **options: object) -> str:
    found = outcome(seed=seed, **options).digest
    assert found is not None
    return found


def test_seed_decides_and_nothing_else(tmp_path: Path) -> None:
    unpaced, paced = outcome(record=False), outcome(record=False, pace=4.0)
    plain = unpaced.digest
    assert plain == digest(tmp_path, record=False)
    assert plain == digest(tmp_path, out=tmp_path / "recorded"), "recording changes nothing"
    assert plain == paced.digest, "pacing changes nothing"
    assert paced.metrics.keys() - unpaced.metrics.keys() == {"pace_losses", "pace_lost_s"}
    assert plain != digest(tmp_path, seed=2, record=False)


def test_a_busy_cpu_changes_nothing(tmp_path: Path) -> None:
    plain = digest(tmp_path, record=False)
    hogs = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(3)]
    try:
        assert digest(tmp_path, record=False) == plain
    finally:
        for hog in hogs:
            hog.kill()
            hog.wait()
