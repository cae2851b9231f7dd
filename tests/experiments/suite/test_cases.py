"""Which tests a scenario file makes, and what is told of a wrong one."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.errors import ScenarioError
from twin.experiments.suite.cases import cases_in, cases_of
from twin.experiments.suite.selection import selected
from twin.scenario.schema import load

SCENARIO = """\
name: demo
seed: 5
duration: 1 s
robots: [{model: diff_bot}]
mission: {type: velocity_profile, robot: diff_bot, steps: [{duration: 1 s, linear: 0.1 m/s}]}
checks: [{energy: {max: 1}}]
"""


def write(folder: Path, test: str = "") -> Path:
    file = folder / "file.yaml"
    file.write_text(SCENARIO + test, encoding="utf-8")
    return file


def test_a_file_without_the_key_is_one_test(tmp_path: Path) -> None:
    file = write(tmp_path)
    (case,) = cases_of(file)
    assert (case.name, dict(case.overrides), case.tags) == ("demo", {}, ())
    assert case.command == f"twin run {file}"


def test_each_test_has_a_folder_of_its_own_however_long_its_name(tmp_path: Path) -> None:
    file = write(tmp_path, "test:\n  grid:\n    mission.steps.0.linear: [0.1 m/s, 0.2 m/s]\n")
    file.write_text(file.read_text("utf-8").replace("name: demo", f"name: {'d' * 200}"), encoding="utf-8")
    folders = [case.folder for case in cases_of(file)]
    assert len(set(folders)) == 2
    assert max(map(len, folders)) <= 150


def test_each_seed_and_each_combination_is_a_test_whose_command_makes_that_run(tmp_path: Path) -> None:
    file = write(
        tmp_path,
        "test:\n  seeds: 3..4\n  tags: [quick]\n  grid:\n"
        "    mission.steps.0.linear: [0.1 m/s, 20 cm/s]\n    robots.0.pose: [{x: 1}, {y: 2 m}]\n",
    )
    cases = cases_of(file)
    assert [case.name for case in cases] == [
        f"demo[seed={seed},linear={speed},pose={pose}]"
        for speed in ("0.1m/s", "20cm/s")
        for pose in ("#1", "#2")
        for seed in (3, 4)
    ]
    last = cases[-1]
    assert last.tags == ("quick",)
    scenario = load(file, last.overrides)
    assert (scenario.seed, scenario.mission.steps[0].linear) == (4, 0.2)
    assert scenario.robots[0].pose.y == 2.0
    assert last.command.endswith(
        "file.yaml --seed 4 --set 'mission.steps.0.linear=20 cm/s' --set 'robots.0.pose={\"y\":\"2 m\"}'"
    )
    assert len({case.folder for case in cases}) == len(cases)
    assert not any(set("/[] ") & set(case.folder) for case in cases)


def test_names_of_keys_are_as_long_as_it_takes_to_tell_them_apart(tmp_path: Path) -> None:
    grid = "test: {grid: {physics.timestep: [1 ms], robots.0.pose.x: [1], checks.0.energy.max: [1]}}"
    (case,) = cases_of(write(tmp_path, grid))
    assert case.name == "demo[timestep=1ms,x=1,max=1]"
    two = SCENARIO.replace("[{model: diff_bot}]", "[{model: diff_bot}, {model: diff_bot, name: b}]")
    two = two.replace("{max: 1}", "{max: 1, robot: b}")
    file = tmp_path / "two.yaml"
    file.write_text(two + "test: {grid: {robots.0.pose.x: [1], robots.1.pose.x: [-1]}}\n", encoding="utf-8")
    assert [case.name for case in cases_of(file)] == ["demo[0.pose.x=1,1.pose.x=-1]"]


def test_seeds_are_written_as_for_a_sweep(tmp_path: Path) -> None:
    for text in ("1..3", "1:4", '"1, 2:4"'):
        assert [case.seed for case in cases_in([write(tmp_path, f"test: {{seeds: {text}}}\n")])] == [1, 2, 3]


def test_a_test_keeps_its_number_whichever_are_chosen(tmp_path: Path) -> None:
    cases = cases_in([write(tmp_path, "test: {seeds: 1..4}\n")])
    assert [case.number for case in selected(cases, shard=(2, 2))] == [2, 4]


def test_twin_run_does_not_look_at_the_key(tmp_path: Path) -> None:
    file = write(tmp_path, "test: {seeds: 7..9, grid: {duration: [2 s]}}\n")
    scenario = load(file)
    assert (scenario.seed, scenario.duration) == (5, 1.0)


@pytest.mark.parametrize(
    ("test", "says"),
    [
        ("seeds: 9..3", "file.yaml:7: test.seeds: has no seed in 9..3; the first number must be less than"),
        ("seeds: 1.5..3", r"test.seeds: must be a list of seeds, 1,5,9, or a range such as 1..10 or 0:10"),
        ("seeds: []", "file.yaml:7: test.seeds: must have at least one seed"),
        ("seeds: [-1]", "file.yaml:7: test.seeds.0: must be at least 0"),
        ("seeds: 0..99999999999", "test.seeds: must be at most 10000 seeds"),
        ("seeds: 1..5000, grid: {duration: [1, 2, 3]}", "file.yaml:7: test makes 15000 tests; at most 10000"),
        ("tags: [a-b]", "test.tags.0: must be a word of letters, digits and _, such as quick, not 'a-b'"),
        ("grid: {duration: []}", "file.yaml:7: test.grid.duration: must have at least 1 items"),
        ("grid: {seed: [1]}", "file.yaml:7: test.grid has the key seed; write seeds beside grid"),
        ("grid: {duration: [1 s, 1 kg]}", "yaml:7: test.grid: override duration=1 kg: duration: must have a"),
        ("grid: {robots.0.mdoel: [diff_bot]}", "unknown key 'mdoel' in robots.0; did you mean 'model'?"),
        ("grid: {robots.1.pose.x: [1]}", "no item '1' in robots; valid: indices 0 to 0"),
        ("sedes: 1..2", "unknown key 'sedes' in test; did you mean 'seeds'?"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_with_its_line(tmp_path: Path, test: str, says: str) -> None:
    file = write(tmp_path, f"test: {{{test}}}\n")
    with pytest.raises(ScenarioError) as wrong:
        cases_of(file)
    assert says in str(wrong.value)
    (case,) = cases_in([file])
    assert (case.name, says in case.error) == ("file", True)


def test_all_wrong_values_of_a_grid_are_told_at_once(tmp_path: Path) -> None:
    file = write(tmp_path, "test: {grid: {duration: [1 kg, 2 kg], physics.timestp: [1 ms]}}\n")
    with pytest.raises(ScenarioError) as wrong:
        cases_of(file)
    assert len(wrong.value.problems) == 3


def test_a_path_in_a_grid_starts_at_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    for folder, width in ((here, 1), (there, 2)):
        folder.mkdir()
        (folder / "a.urdf").write_text(
            f'<robot name="r{width}"><link name="base_link"/></robot>', encoding="utf-8"
        )
    monkeypatch.chdir(here)
    (there / "file.yaml").write_text(
        "name: demo\nduration: 1 s\nrobots: [{model: diff_bot}]\nchecks: [{energy: {max: 1}}]\n"
        "test: {grid: {robots.0.model: [./a.urdf, diff_bot]}}\n",
        encoding="utf-8",
    )
    file = there / "file.yaml"
    models = [load(file, case.overrides).robots[0].model for case in cases_of(file)]
    assert (Path(models[0]).resolve(), models[1]) == ((there / "a.urdf").resolve(), "diff_bot")
