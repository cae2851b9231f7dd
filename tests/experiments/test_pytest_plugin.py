"""Scenario files are tests of pytest: collected when asked, told in pytest's words, the same beside xdist."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

SPIN = """\
name: spin
duration: 3 s
robots: [{model: diff_bot}]
mission: {type: velocity_profile, robot: diff_bot, steps: [{duration: 0.2 s, linear: 0.2 m/s}]}
checks: [{mission_succeeded: }, {driven_distance: {max: 1 m}}]
test:
  seeds: [1, 2]
  tags: [quick]
  grid: {checks.1.driven_distance.max: [1 m, 1 cm]}
"""
WRONG = "name: wrong\nduration: 1 s\nrobots: [{model: diff_bto}]\nchecks: [{mission_succeeded: }]\n"


@pytest.fixture
def project(tmp_path: Path) -> Path:
    folder = tmp_path / "scenarios"
    folder.mkdir()
    for name, text in {"spin": SPIN, "wrong": WRONG, "hall": "name: hall\nwalls: []\n"}.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "test_other.py").write_text("def test_other(): pass\n", encoding="utf-8")
    (tmp_path / "pytest.ini").write_text("[pytest]\naddopts = --strict-markers\n", encoding="utf-8")
    return tmp_path


def pytest_in(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    # the plugin of this checkout, whatever is installed, and no others: they take their time
    plugins = ("-p", "twin.experiments.pytest_plugin", "-p", "no:cacheprovider")
    command = [sys.executable, "-m", "pytest", *plugins, *words]
    environment = {**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def collected(done: subprocess.CompletedProcess[str]) -> list[str]:
    return re.findall(r"^\S+::.*$", done.stdout, re.MULTILINE)


def test_only_what_is_asked_for_is_collected(project: Path) -> None:
    quiet = ("--collect-only", "-q")
    names = [
        f"scenarios/spin.yaml::spin[seed={seed},max={limit}]" for limit in ("1m", "1cm") for seed in (1, 2)
    ]
    wrong, other = "scenarios/wrong.yaml::wrong", "test_other.py::test_other"
    assert collected(pytest_in(project, *quiet)) == [other]
    assert collected(pytest_in(project, *quiet, "--twin")) == [*names, wrong, other]
    assert (
        collected(pytest_in(project, *quiet, "scenarios/spin.yaml", "-m", "quick", "-k", "1cm")) == names[2:]
    )
    (project / "pytest.ini").write_text("[pytest]\ntwin_scenarios = scenarios/w*.yaml\n", encoding="utf-8")
    assert collected(pytest_in(project, *quiet)) == [wrong, other]


def test_nothing_of_twin_is_loaded_without_a_scenario(project: Path) -> None:
    text = (
        "import sys\ndef test_other():\n    assert not {'twin.errors', 'numpy', 'yaml'} & set(sys.modules)\n"
    )
    (project / "test_other.py").write_text(text, encoding="utf-8")
    done = pytest_in(project, "-q")
    assert "1 passed" in done.stdout, done.stdout


def test_what_is_wrong_with_the_tests_of_a_file_is_an_error_of_collection(project: Path) -> None:
    (project / "scenarios" / "spin.yaml").write_text(SPIN.replace("[1, 2]", "2..1"), encoding="utf-8")
    done = pytest_in(project, "scenarios/spin.yaml")
    assert done.returncode == 2
    assert "scenarios/spin.yaml:7: test.seeds: has no seed in 2..1" in done.stdout
    assert "Traceback" not in done.stdout


def test_passed_failed_and_error_side_by_side(project: Path) -> None:
    (project / "scenarios" / "spin.yaml").write_text(SPIN.replace("[1, 2]", "[1]"), encoding="utf-8")
    out = ("--twin", "--twin-out", "runs/ci", "--junitxml", "junit.xml")
    done = pytest_in(project, "-p", "xdist.plugin", "-n", "2", *out, "scenarios")
    assert done.returncode == 1
    assert re.search(r"1 failed, 1 passed, 1 error in", done.stdout), done.stdout
    told = done.stdout.partition("= FAILURES =")[2]
    assert "driven_distance: diff_bot drove 0.04 m, more than allowed" in told
    assert re.search(r"^FAIL +driven_distance +39\S* mm +10 mm", told, re.MULTILINE), told
    folder = "runs/ci/scenarios-spin/spin-seed=1,max=1cm"
    assert f"written to {folder}" in told
    assert (project / folder / "verdict.json").exists()
    assert (
        "run it again: twin run scenarios/spin.yaml --seed 1 --set 'checks.1.driven_distance.max=1 cm'"
        in told
    )
    errors = done.stdout.partition("= ERRORS =")[2].partition("= FAILURES =")[0]
    assert "the run could not be made or finished: scenarios/wrong.yaml:3: no robot 'diff_bto'" in errors
    assert "Traceback" not in done.stdout
    assert "pytest_plugin.py" not in done.stdout
    (suite,) = ElementTree.parse(project / "junit.xml").getroot()
    assert (suite.get("failures"), suite.get("errors")) == ("1", "1")
    properties = {(p.get("name"), len(p.get("value") or "")) for p in suite.iter("property")}
    assert ("digest", 64) in properties
