"""The smallest scenario that fails the same checks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.experiments.conftest import ARCS, Here
from twin.errors import ScenarioError
from twin.experiments.shrink import Shrunk, as_file, shrink
from twin.experiments.shrink.candidates import Verdict
from twin.experiments.trials import Trial, Trials
from twin.runtime.open_run import run
from twin.scenario.schema import load
from twin.scenario.source import Source

TWELVE: dict[str, Any] = {
    "name": "twelve",
    "seed": 1,
    "duration": "2 s",
    "world": {
        "obstacles": [
            {"name": "box", "pose": {"x": "3 m"}, "size": [0.3, 0.3, 0.3]},
            {"name": "crate", "pose": {"y": "3 m"}, "size": [0.3, 0.3, 0.3], "mass": "2 kg"},
        ]
    },
    "robots": [{"model": "diff_bot", "command_latency": "20 ms"}],
    "mission": {
        "type": "velocity_profile",
        "robot": "diff_bot",
        "steps": [{"duration": "10 s", "linear": "0.2 m/s", "angular": "20 deg/s"}],
    },
    "faults": [
        {"noise": {"sensor": "scan", "stddev": 0.05, "at": "0.2 s", "duration": "1 s"}},
        {"bias": {"sensor": "imu", "field": "angular_velocity.z", "by": 0.1, "when": {"driven": "10 cm"}}},
        {"dropout": {"sensor": "imu", "share": "30 %", "when": {"fault": "noise"}, "after": "0.1 s"}},
        {"odometry_jump": {"at": "0.6 s", "distance": "1 mm"}},
        {"delay": {"sensor": "scan", "time": "80 ms", "at": "0.4 s"}},
        {"link_delay": {"time": "20 ms", "topic": "/scan", "when": {"fault": "bias"}}},
        {"encoder": {"joint": "wheel_right_joint", "factor": 0.6, "when": {"driven": "15 cm"}}},
        {"lidar": {"at": "1.1 s", "kind": "blind"}},
        {"duplication": {"share": "50 %", "topic": "/imu"}},
        {"mass": 1.02},
        {"pallet": {"pose": {"x": "-4 m"}, "when": {"fault": "encoder"}}},
        {"encoder": {"label": "late", "joint": "wheel_right_joint", "factor": 0.6, "at": "1.95 s"}},
    ],
    "checks": [{"driven_distance": {"min": "0.2 m"}}, {"odometry_drift": {"max": "3 cm"}}],
}


def source(data: Mapping[str, Any], folder: Path) -> Source:
    file = folder / "given.yaml"
    file.write_text(yaml.safe_dump(dict(data)), encoding="utf-8")
    return load(file).source


def test_of_twelve_faults_the_one_that_matters_is_left(tmp_path: Path) -> None:
    found = shrink(source(TWELVE, tmp_path), {}, Here())
    assert found.left == ("faults.0 encoder",)
    assert found.source.data["faults"] == [TWELVE["faults"][6]]
    assert found.checks == ("odometry_drift",)
    assert {"robots.0.command_latency: 20 ms", "world.obstacles.0 box", "faults.11 encoder"} <= set(
        found.removed
    )

    file = tmp_path / "elsewhere" / "smallest.yaml"
    as_file.write(found.source, file, ["the smallest"])
    verdict = run(load(file), record=False)
    assert [(check.name, check.passed) for check in verdict.checks] == [("odometry_drift", False)]
    assert verdict.digest == found.verdict["digest"]
    shorter = load(file, {"duration": f"{found.durations_s[1] - 0.1} s"})
    assert run(shorter, record=False).verdict == "pass"


Rule = Callable[[Mapping[str, Any]], bool]


class Foretold(Trials):
    """Runs of which a rule tells whether their checks fail."""

    def __init__(
        self, fails: Rule, count: int = 1, at_s: Callable[[Mapping[str, Any]], float] = lambda data: 1.0
    ) -> None:
        super().__init__(count=count)
        self.fails, self.at_s = fails, at_s
        self.seen: list[Mapping[str, Any]] = []

    def verdicts(self, trials: Sequence[Trial]) -> list[Verdict]:
        return [self._verdict(trial) for trial in trials]

    def _verdict(self, trial: Trial) -> Verdict:
        data = trial.source.data
        self.seen.append(data)
        duration_s = float(str(data["duration"]).removesuffix(" s"))
        failed = self.fails(data)
        check = {
            "passed": not failed,
            "name": "c",
            "reason": "hit 3" if failed else "",
            "at_s": self.at_s(data),
        }
        checks = [check if "no_collision" in entry else {**check, "passed": True} for entry in data["checks"]]
        return {
            "scenario": data["name"],
            "error": None,
            "digest": "abc",
            "verdict": "fail" if failed else "pass",
            "checks": checks,
            "metrics": {"sim_time_s": duration_s},
        }


def shrunk(
    data: dict[str, Any], folder: Path, trials: Trials, overrides: Mapping[str, str] | None = None
) -> Shrunk:
    return shrink(source(data, folder), overrides or {}, trials)


def with_faults(count: int) -> dict[str, Any]:
    data: dict[str, Any] = yaml.safe_load(ARCS)
    data["duration"] = "3 s"
    data["checks"] = [{"driven_distance": {"min": "0.1 m"}}, {"no_collision": None}]
    data["faults"] = [{"odometry_jump": {"at": index / 10, "distance": 0.1}} for index in range(count)]
    return data


def times(data: Mapping[str, Any]) -> set[int]:
    return {round(10 * fault["odometry_jump"]["at"]) for fault in data.get("faults", ())}


@pytest.mark.parametrize("count", [1, 2, 5])
def test_two_faults_that_fail_only_together_are_left_however_many_run_at_a_time(
    tmp_path: Path, count: int
) -> None:
    trials = Foretold(lambda data: {3, 8} <= times(data), count)
    found = shrunk(with_faults(12), tmp_path, trials)
    assert times(found.source.data) == {3, 8}
    assert found.source.data["checks"] == [{"no_collision": None}]


def test_a_group_of_parameters_is_reduced_to_the_one_that_matters(tmp_path: Path) -> None:
    data = with_faults(0) | {"world": {"arena": "warehouse"}}
    data["robots"] = [
        {
            "model": "warehouse_bot",
            "start": "start",
            "localisation": {"type": "odometry"},
            "navigation": {
                "planner": {"allow_unknown": False, "tolerance": 0.1},
                "local_costmap": {"width": 3},
            },
        }
    ]
    data["mission"]["robot"] = "warehouse_bot"
    trials = Foretold(lambda data: "tolerance" in str(data["robots"][0].get("navigation")))
    found = shrunk(data, tmp_path, trials)
    (robot,) = found.source.data["robots"]
    assert robot["navigation"] == {"planner": {"tolerance": 0.1}}
    assert robot["start"] == "start"


def test_an_override_that_does_not_matter_goes_back_to_what_the_file_says(tmp_path: Path) -> None:
    def fails(data: Mapping[str, Any]) -> bool:
        return str(data["mission"]["steps"][0].get("linear")) == "0.3"

    overrides = {"seed": "5", "mission.steps.0.linear": "0.3", "mission.steps.1.linear": "0.4"}
    found = shrunk(with_faults(0), tmp_path, Foretold(fails), overrides)
    assert "--set mission.steps.1.linear=0.4" in found.removed
    steps = found.source.data["mission"]["steps"]
    assert [str(step["linear"]) for step in steps] == ["0.3"]
    assert found.source.data["seed"] == 5


def test_the_run_is_cut_where_its_failure_was_decided(tmp_path: Path) -> None:
    def fails(data: Mapping[str, Any]) -> bool:
        return 2 in times(data) and float(str(data["duration"]).removesuffix(" s")) >= 2.345

    found = shrunk(with_faults(4), tmp_path, Foretold(fails, at_s=lambda data: 2.345))
    assert found.durations_s == (3.0, 2.4)


def test_nothing_is_cut_so_short_that_it_fails_without_its_cause_too(tmp_path: Path) -> None:
    """A check that fails while too little was done must not pass for the failure that is sought."""

    def lasts(data: Mapping[str, Any]) -> float:
        return float(str(data["duration"]).removesuffix(" s"))

    def fails(data: Mapping[str, Any]) -> bool:
        return 2 in times(data) or lasts(data) < 1.75 or len(data["mission"]["steps"]) < 2

    found = shrunk(with_faults(4), tmp_path, Foretold(fails, at_s=lasts))
    assert times(found.source.data) == {2}
    assert found.durations_s == (3.0, 1.8)
    assert len(found.source.data["mission"]["steps"]) == 2


def test_a_scenario_that_passes_has_nothing_to_shrink(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="arcs passes all its checks: there is no failure to shrink"):
        shrunk(with_faults(1), tmp_path, Foretold(lambda data: False))


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"error": "the physics diverged"}, "arcs cannot be run: the physics diverged"),
        (
            {"reason": "nothing to look at: nothing moved"},
            "fails only as a check has nothing to look at: nothing moved",
        ),
    ],
)
def test_what_says_nothing_is_refused(tmp_path: Path, change: dict[str, str], why: str) -> None:
    class Other(Foretold):
        def _verdict(self, trial: Trial) -> Verdict:
            verdict = {**super()._verdict(trial)}
            if "reason" in change:
                verdict["checks"] = [
                    {**check, **change} if check["reason"] else check for check in verdict["checks"]
                ]
                return verdict
            return {**verdict, **change}

    with pytest.raises(ScenarioError, match=why):
        shrunk(with_faults(1), tmp_path, Other(lambda data: True))


def test_what_is_another_run_each_time_is_refused(tmp_path: Path) -> None:
    class Flaky(Foretold):
        def _verdict(self, trial: Trial) -> Verdict:
            return {**super()._verdict(trial), "digest": f"{trial.repeat:012d}"}

    with pytest.raises(ScenarioError, match="is not the same run twice"):
        shrunk(with_faults(1), tmp_path, Flaky(lambda data: True))


def test_what_is_written_is_read_as_it_was(tmp_path: Path) -> None:
    """Texts that look like numbers, and files as seen from the new folder."""
    robot = tmp_path / "robot.urdf"
    robot.write_text("<robot name='r'/>", encoding="utf-8")
    data = with_faults(1) | {
        "description": "1e3",
        "robots": [{"model": "./robot.urdf", "name": "diff_bot", "args": {"a": "0o7", "b": "on"}}],
    }
    file = tmp_path / "deep" / "er" / "out.yaml"
    as_file.write(Source(tmp_path / "given.yaml", data), file, ["a line"])
    assert file.read_text("utf-8").startswith("# a line\n")
    read = load(file).source.data
    assert read["robots"][0] == {
        "model": "../../robot.urdf",
        "name": "diff_bot",
        "args": {"a": "0o7", "b": "on"},
    }
    assert {**read, "robots": None} == {**data, "robots": None}
