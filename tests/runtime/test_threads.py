"""What is left of runs that are over, nothing that a fork would miss; and what they need not load."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

SCENARIOS = Path(__file__).parents[2] / "scenarios"

_RUNS = """
import json, os, sys
from pathlib import Path

import twin
from twin.scenario.schema import load

scenario, recorded, out = sys.argv[1], sys.argv[2] == "recorded", Path(sys.argv[3])
if recorded:
    import rerun  # whose import starts threads

def threads():
    return len(os.listdir("/proc/self/task"))

def digest(name, *, seed=1):
    folder = out / name if recorded else None
    return twin.run(scenario, seed=seed, overrides={"duration": "1 s"}, out=folder).digest

told = {"before": threads(), "digests": [digest("first"), digest("second", seed=2)]}
told["left"] = threads()
told["unneeded"] = [name for name in ("numba", "scipy") if name in sys.modules]
twin.end_threads()
told["ended"] = threads()
ends = os.pipe()
if not os.fork():
    again = [threads(), digest("child")]
    twin.end_threads()
    os.write(ends[1], json.dumps([*again, threads()]).encode())
    os._exit(0)
os.wait()
told["child"] = json.loads(os.read(ends[0], 4096))
told["again"] = digest("again")
print(json.dumps(told))
"""


def test_navigation_loads_no_linear_algebra() -> None:
    """A kernel that lets numba take an extremum of an array would load SciPy's, for 0.2 s in the loop."""
    run = "import sys, twin; twin.run(sys.argv[1], overrides={'duration': '3 s'}); print(*sys.modules)"
    command = [sys.executable, "-c", run, str(SCENARIOS / "warehouse.yaml")]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    loaded = told.split()
    assert "numba" in loaded
    assert "scipy.linalg" not in loaded


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="no /proc")
@pytest.mark.parametrize("recorded", [False, True])
def test_a_process_can_be_forked_after_runs(recorded: bool, tmp_path: Path) -> None:
    command = [sys.executable, "-c", _RUNS, str(SCENARIOS / "diff_bot_figure8.yaml")]
    command += ["recorded" if recorded else "", str(tmp_path)]
    one = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    told = json.loads(subprocess.run(command, env=one, check=True, capture_output=True).stdout)
    assert told["ended"] == told["before"]
    assert (told["before"] == 1) is not recorded
    assert (told["left"] == 1) is not recorded
    assert told["unneeded"] == []  # such a scenario navigates nowhere
    first, second = told["digests"]
    assert first != second
    assert told["child"] == [1, first, 1]
    assert told["again"] == first
    if recorded:
        sizes = {
            name: (tmp_path / name / "diff_bot_figure8.rrd").stat().st_size for name in ("first", "child")
        }
        assert sizes["child"] == pytest.approx(sizes["first"], rel=0.05)
