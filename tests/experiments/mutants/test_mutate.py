"""Which known-bad stacks the checks of a scenario catch."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from tests.experiments.conftest import Here
from twin.errors import PluginError, ScenarioError
from twin.experiments.mutants import MUTANTS, Mutant, Outcome, Report, Site, mutate
from twin.experiments.mutants.trial import MutantTrial
from twin.experiments.trials import Trial
from twin.runtime.open_run import OpenRun
from twin.scenario.schema import load
from twin.warehouse.pick_and_place import PickAndPlaceNode

STRAIGHT = """\
name: straight
seed: 1
duration: 1.5 s
robots: [{model: diff_bot}]
mission: {type: velocity_profile, robot: diff_bot, steps: [{duration: 5 s, linear: 0.2 m/s}]}
checks:
  - driven_distance: {min: 0.2 m, max: 0.3 m}
  - odometry_drift: {max: 1 cm}
"""


@pytest.fixture
def straight(tmp_path: Path) -> Path:
    """Return the file of a robot that drives straight ahead for 2 s."""
    file = tmp_path / "straight.yaml"
    file.write_text(STRAIGHT, encoding="utf-8")
    return file


def fates(report: Report) -> dict[str, str]:
    return {outcome.mutant: outcome.fate for outcome in report.outcomes}


def test_each_mutant_is_caught_survives_changes_nothing_or_is_not_here(straight: Path) -> None:
    expected = {
        "mirrored_wheel": "caught",
        "doubled_commands": "caught",
        "frozen_odometry": "caught",
        "swapped_wheels": "no effect",  # both get the same commands
        "track_off": "survived",  # of a robot that never turns
        "lidar_frame": "survived",  # nobody looks at the lidar
        "map_shifted": "not here",
        "small_inflation": "not here",
        "weak_grasp": "not here",
    }
    report = mutate(load(straight).source, Here(), list(expected))
    assert fates(report) == expected
    assert report.score == pytest.approx(3 / 5)
    first = report.outcomes[0]
    assert "driven_distance" in first.by
    assert first.why
    assert report.outcomes[6].why == "nobody publishes map"


def test_a_run_with_a_mutant_leaves_nothing_behind(straight: Path) -> None:
    """Runs of one process follow each other: what was patched in code must be whole again."""
    source = load(straight).source
    before = Trial(source).perform()["digest"]
    config = PickAndPlaceNode.config
    for name in ("early_release", "doubled_commands"):
        MutantTrial(source, mutant=name).perform()
    assert PickAndPlaceNode.config is config
    assert Trial(source).perform()["digest"] == before


OWN = '''
from dataclasses import replace

from twin.experiments.mutants import Mutant


class Stutter(Mutant):
    """Every other command is lost.

    As on a bad cable.
    """

    def install(self, site):
        count = iter(range(10**9))
        site.rewrite("cmd_vel", lambda message: message if next(count) % 2 else None)


class Slow(Mutant):
    """The robot is asked for half the speed."""

    def edit(self, data):
        data["mission"]["steps"][0]["linear"] = "0.1 m/s"


class Heavy(Mutant):
    """The mission fails at once."""

    def adjust(self, run):
        run.parts.mission.finish(succeeded=False)


class Broken(Mutant):
    """It raises."""

    def install(self, site):
        raise KeyError("oh")


class Twisted(Mutant):
    """The scenario is none any more."""

    def edit(self, data):
        data["robots"] = []
'''


def test_mutants_of_ones_own(straight: Path) -> None:
    file = straight.with_name("bad.py")
    file.write_text(OWN, encoding="utf-8")
    names = [f"{file}:{name}" for name in ("Stutter", "Slow", "Heavy")]
    report = mutate(load(straight).source, Here(), names)
    assert [outcome.says for outcome in report.outcomes] == [
        "Every other command is lost.",
        "The robot is asked for half the speed.",
        "The mission fails at once.",
    ]
    assert [outcome.fate for outcome in report.outcomes] == ["survived", "caught", "caught"]
    with pytest.raises(
        PluginError, match="there is no mutant 'mirrored_weel'; did you mean 'mirrored_wheel'"
    ):
        mutate(load(straight).source, Here(), ["mirrored_weel"])


@pytest.mark.parametrize("place", ["{file}:Slow", "a_bad_one:Slow"])
def test_a_mutant_that_was_edited_is_another_one(
    straight: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    file = straight.with_name("a_bad_one.py")
    file.write_text(OWN, encoding="utf-8")
    monkeypatch.syspath_prepend(str(straight.parent))
    trial = MutantTrial(load(straight).source, mutant=place.format(file=file))
    before = trial.key
    assert trial.key == before
    file.write_text(OWN.replace("0.1 m/s", "0.15 m/s"), encoding="utf-8")
    assert trial.key != before, "what is remembered of the old one does not count"


def test_a_mutant_that_is_wrong_itself_catches_nothing(straight: Path) -> None:
    file = straight.with_name("bad.py")
    file.write_text(OWN, encoding="utf-8")
    source = load(straight).source
    report = mutate(source, Here(), [f"{file}:Twisted"])
    assert [outcome.fate for outcome in report.outcomes] == ["not here"]
    assert "cannot be changed so: robots: must have at least 1 item" in report.outcomes[0].why
    with pytest.raises(PluginError, match=r"bad.py:\d+: .*KeyError"):
        mutate(source, Here(), [f"{file}:Broken"])


def test_a_scenario_that_fails_by_itself_can_catch_nothing(straight: Path) -> None:
    source = load(
        straight, {"checks.0.driven_distance.min": "0.5 m", "checks.0.driven_distance.max": "1 m"}
    ).source
    with pytest.raises(
        ScenarioError, match=r"straight does not pass by itself, .*: it fails driven_distance"
    ):
        mutate(source, Here(), ["mirrored_wheel"])


def test_without_a_mutant_that_has_an_effect_there_is_no_score() -> None:
    outcome = Outcome(mutant="x", says="y", fate="no effect")
    assert Report(scenario="s", outcomes=(outcome,)).score is None


def test_all_that_ship_say_what_is_wrong() -> None:
    classes = [MUTANTS.find(name).load() for name in MUTANTS.names()]
    assert len(classes) >= 20
    says = [cls.says() for cls in classes]
    assert all(
        issubclass(cls, Mutant) and sentence.endswith(".")
        for cls, sentence in zip(classes, says, strict=True)
    )
    assert len(set(says)) == len(says)


def fixed_frames(file: Path, mutant: Mutant) -> dict[str, float]:
    """Return x of every fixed frame, as it is published."""
    samples: list[Any] = []
    with ExitStack() as ending:
        run = OpenRun(
            load(file),
            record=False,
            taps=[samples.append],
            before_nodes=lambda world, bus: mutant.install(Site(world, bus, ending)),
        )
        run.close()
    (static,) = [sample for sample in samples if sample.topic == "/tf_static"]
    return {each.child_frame_id: each.transform.translation.x for each in static.message.transforms}


def test_what_is_published_before_the_first_tick_is_rewritten_too(straight: Path) -> None:
    """Latched messages, such as fixed frames, are published while nodes are made."""
    before = fixed_frames(straight, Mutant())
    after = fixed_frames(straight, MUTANTS.find("lidar_frame").create())
    (frame,) = [name for name, x in before.items() if after[name] != x]
    assert "scan" in frame or "lidar" in frame
    assert after[frame] == pytest.approx(before[frame] - 0.5)
