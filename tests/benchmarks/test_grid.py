"""`twin bench grid`: formats, scores, exit codes."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from twin.cli import app as app_module
from twin.errors import MapError
from twin_benchmarks import grid as grid_module
from twin_benchmarks.grid import path_cost, run_problems
from twin_benchmarks.grid_files import read_grid_problems
from twin_benchmarks.grid_maps import MapBenchConfig, costmap_of, random_pairs, run_map

DATA = Path(__file__).parents[3] / "shared" / "data"
ROWS = ["..@..", ".T.W.", "..GS."]

Invoke = Callable[..., tuple[int, str, str]]


@pytest.fixture
def invoke(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Invoke:
    def call(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["twin", "bench", "grid", *map(str, arguments)])
        with pytest.raises(SystemExit) as exit_info:
            app_module.run_app()
        captured = capsys.readouterr()
        assert isinstance(exit_info.value.code, int)
        return exit_info.value.code, captured.out, captured.err

    return call


@pytest.fixture
def no_peer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "nano_astar", None)


def write_movingai(folder: Path, optimal: float, rows: list[str] = ROWS) -> dict[str, Path]:
    """The same map and problem in both formats."""
    text = f"type octile\nheight {len(rows)}\nwidth {len(rows[0])}\nmap\n" + "\n".join(rows) + "\n"
    (folder / "m.map").write_text(text, encoding="utf-8")
    line = f"0\tmaps/m.map\t5\t3\t0\t0\t4\t0\t{optimal}\n"
    (folder / "m.map.scen").write_text("version 1\n" + line, encoding="utf-8")
    content = {"rows": rows, "problems": [[0, 0, 4, 0, optimal]]}
    (folder / "m.json").write_text(json.dumps(content), encoding="utf-8")
    return {name: folder / name for name in ("m.map", "m.map.scen", "m.json")}


OPTIMAL = 8.0
"""Down, along the bottom, up: no corner can be cut."""


@pytest.mark.parametrize("name", ["m.map", "m.map.scen", "m.json"])
def test_all_formats_say_the_same(tmp_path: Path, name: str) -> None:
    bench = read_grid_problems(write_movingai(tmp_path, OPTIMAL)[name])
    assert bench.free.tolist() == [[c in ".GS" for c in row] for row in ROWS]
    (problem,) = bench.problems
    assert (problem.start, problem.goal, problem.optimal) == ((0, 0), (4, 0), OPTIMAL)
    result = run_problems(bench)
    assert (result.problems, result.optimal, result.worst_error) == (1, 1, pytest.approx(0.0))


def test_a_path_that_cuts_a_corner_jumps_or_is_blocked_has_no_length(tmp_path: Path) -> None:
    bench = read_grid_problems(write_movingai(tmp_path, OPTIMAL)["m.json"])
    good = np.array([0, 5, 10, 11, 12, 13, 14, 9, 4])
    assert path_cost(bench, good) == OPTIMAL
    for bad in ([5, 11], [0, 10], [0, 1, 2, 3, 4], [1, 7]):
        assert path_cost(bench, np.array(bad)) == math.inf


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.txt", "", "a.txt: the file is no grid benchmark; valid is a MovingAI .map, .scen or .json"),
        ("a.json", "[]", 'is not MovingAI JSON; valid is {"rows"'),
        ("a.json", '{"rows": ["..", "."], "problems": []}', "row 1 has 1 cells; valid is 2 as in row 0"),
        ("a.json", '{"rows": [".@"], "problems": [[0, 0, 1, 0, 1]]}', "(1, 0), which is not free"),
        ("a.map", "type octile\n", "no problems beside the map; valid is a.map.scen"),
        ("a.scen", "version 1\n0 m.map 5\n", "a.scen:2: the line is no problem"),
        ("a.scen", "version 1\n0 m.map 5 3 1e999 0 4 0 8\n", "a.scen:2: the line is no problem"),
        ("a.json", '{"rows": ["..", ".."], "problems": [[0, 0, Infinity, 0, 1]]}', "is not MovingAI JSON"),
        ("a.json", '{"rows": ["..", ".."], "problems": [[0, 1e999, 1, 0, 1]]}', "is not MovingAI JSON"),
        ("a.scen", "version 1\n0 m.map 1 1 0 0 0 0 0\n", "m.map cannot be read"),
    ],
)
def test_wrong_files_are_told_in_a_sentence(
    tmp_path: Path, invoke: Invoke, name: str, text: str, said: str
) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    code, out, err = invoke(tmp_path / name)
    assert (code, out) == (2, "")
    assert said in err.replace("\n", " ").replace("  ", " ")


def test_json_table_and_exit_code(tmp_path: Path, invoke: Invoke, no_peer: None) -> None:
    file = write_movingai(tmp_path, OPTIMAL)["m.json"]
    code, out, _ = invoke(file, "--json")
    report = json.loads(out)
    assert (code, report["passed"], report["nano_astar"]) == (0, True, False)
    (result,) = report["results"]
    assert (result["optimal"], result["problems"], result["ratio"]) == (1, 1, None)
    code, out, err = invoke(file)
    assert code == 0
    assert "1/1" in out
    assert "nano_astar is not installed" in err
    wrong = write_movingai(tmp_path, OPTIMAL - 0.001)["m.json"]
    code, out, _ = invoke(wrong, "--json")
    assert (code, json.loads(out)["results"][0]["optimal"]) == (1, 0), "off by more than 1e-6"


def test_being_slower_than_the_limit_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grid_module, "MAX_RATIO", 0.0)
    monkeypatch.setattr(grid_module, "nano_astar", lambda: lambda *_: None)
    result = run_problems(read_grid_problems(write_movingai(tmp_path, OPTIMAL)["m.json"]))
    assert result.optimal == 1
    assert result.ratio is not None
    assert not result.passed


def write_map(folder: Path) -> Path:
    """8 x 5 m with a wall that has a gap."""
    gray = np.full((100, 160), 254, dtype=np.uint8)
    gray[[0, -1]] = gray[:, [0, -1]] = 0
    gray[:70, 80] = 0
    (folder / "hall.pgm").write_bytes(b"P5\n160 100\n255\n" + gray.tobytes())
    (folder / "hall.yaml").write_text(
        "image: hall.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.25\n",
        encoding="utf-8",
    )
    return folder / "hall.yaml"


def test_a_map_is_planned_on_by_every_planner(tmp_path: Path, invoke: Invoke, no_peer: None) -> None:
    path = write_map(tmp_path)
    config = MapBenchConfig(pairs=5)
    pairs = random_pairs(path, costmap_of(path, config), config)
    assert pairs == random_pairs(path, costmap_of(path, config), config)
    assert all(start.distance(goal) > 3.0 for start, goal in pairs)
    result = run_map(path, config)
    rows = {row.planner: row for row in result.rows}
    assert {row.solved for row in rows.values()} == {5}
    assert rows["A*, free or not"].length <= rows["grid_based"].length + 1e-9
    assert rows["theta_star"].length < rows["grid_based"].length
    assert rows["grid_based"].cost < rows["A*, free or not"].cost
    code, out, _ = invoke(path, "--pairs", 2)
    assert code == 0
    assert "5 of 5" not in out
    assert "2 of 2 pairs" in out


def test_a_map_without_room_is_refused(tmp_path: Path) -> None:
    path = write_map(tmp_path)
    config = MapBenchConfig(pairs=2, min_distance=50.0)
    with pytest.raises(MapError, match="no 2 pairs of free places 50 m apart"):
        random_pairs(path, costmap_of(path, config), config)


@pytest.mark.skipif(not DATA.is_dir(), reason="public data not there")
def test_every_problem_of_movingai_is_solved_optimally(no_peer: None) -> None:
    for file in sorted((DATA / "movingai").glob("*.json")):
        result = run_problems(read_grid_problems(file))
        assert result.optimal == result.problems, file.name
