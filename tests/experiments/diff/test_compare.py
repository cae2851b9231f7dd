"""Where two runs part is found from what they kept, to the tick and field."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import twin
from tests.experiments.conftest import ARCS
from twin.errors import RecordingError
from twin.experiments.diff import Difference, Divergence, Side, compare, made_again, of_path
from twin.experiments.diff.changes import since
from twin.experiments.diff.difference import PHYSICS
from twin.recording.hashes import HASHES
from twin.runtime.kept_run import KeptRun
from twin.runtime.open_run import OpenRun
from twin.runtime.open_run import run as run_of
from twin.scenario.schema import load

Make = Callable[..., Side]


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Make:
    """Return what runs the scenario, once for each set of overrides; only the hashes are left of a run."""
    place = tmp_path_factory.mktemp("runs")
    file = place / "arcs.yaml"
    file.write_text(ARCS, encoding="utf-8")

    @cache
    def run(**overrides: Any) -> Side:
        folder = place / f"run{len(list(place.iterdir()))}"
        changed = {key.replace("__", "."): str(each) for key, each in overrides.items()}
        run_of(load(file, changed), out=folder, record=False)
        for left in folder.iterdir():
            if left.name != HASHES:
                left.unlink()
        return of_path(folder)

    return run


def ticks_of(file: Path, overrides: dict[str, str]) -> list[list[tuple[int, str, bytes]]]:
    """Return all messages of a run, by tick; those of nodes that are made are in the first list."""
    ticks: list[list[tuple[int, str, bytes]]] = [[]]
    run = OpenRun(
        load(file, overrides),
        record=False,
        taps=[lambda sample: ticks[-1].append((sample.time_ns, sample.topic, sample.payload))],
    )
    ticks.append([])
    try:
        run.advance(lambda: bool(ticks.append([])))
    finally:
        run.close()
    return ticks


def brute_force(file: Path, overrides: dict[str, str]) -> tuple[int, int, str]:
    """Return tick, time [ns] and topic of the first message that differs, from whole runs side by side."""
    both = zip(ticks_of(file, {}), ticks_of(file, overrides), strict=True)
    for tick, (one, other) in enumerate(both):
        for a, b in zip(one, other, strict=True):
            if a != b:
                return tick, a[0], a[1]
    raise AssertionError("no difference")


def test_a_millionth_in_a_command_is_located_in_runs_that_are_over(arcs: Path, kept: Make) -> None:
    planted = {"mission.steps.1.linear": "0.200001"}
    a, b = kept(), kept(mission__steps__1__linear=0.200001)
    tick, time_ns, topic = brute_force(arcs, planted)
    arcs.unlink()  # last week's file is gone

    found = compare(a, b)

    assert not found.same
    assert [change.key for change in found.changes] == ["mission.steps.1.linear"]
    first = found.first[0]
    assert (first.tick, first.time_ns, first.topic) == (tick, time_ns, topic)
    assert (first.topic, first.field, first.a, first.b) == ("/cmd_vel", "linear.x", 0.2, 0.200001)
    assert first.change == pytest.approx(1e-6)
    assert found.second == first.time_ns // 10**9 == 1
    times = [one.time_ns for one in found.first]
    assert times == sorted(times)


def test_the_first_physics_step_that_differs_is_named(kept: Make) -> None:
    found = compare(kept(), kept(robots__0__pose__x=1e-6))
    physics = next(one for one in found.first if one.topic == PHYSICS)
    assert (physics.type, physics.tick, physics.time_ns) == ("step 1", 1, 2_000_000)
    assert (physics.field, physics.a) == ("x of diff_bot/base_footprint", pytest.approx(0.0, abs=1e-6))
    assert physics.change == pytest.approx(1e-6, rel=1e-3)


def test_the_seed_shows_where_noise_is_published_and_nowhere_else(kept: Make) -> None:
    found = compare(kept(), kept(seed=2))
    assert found.first[0].topic == "/imu"  # the first that is noisy
    assert all(one.topic not in (PHYSICS, "/cmd_vel") for one in found.first)  # driven open loop


def test_the_same_run_is_the_same_wherever_it_comes_from(arcs: Path, kept: Make) -> None:
    first = kept()
    for other in (of_path(arcs), of_path(Path(first.name) / HASHES), made_again(first)):
        found = compare(first, other)
        assert (found.same, found.first, found.second) == (True, (), None)
        assert found.digest_a == found.digest_b is not None


def test_what_changes_nothing_is_told_as_the_same_run(kept: Make) -> None:
    found = compare(kept(), kept(description="other words"))
    assert found.same
    assert [change.key for change in found.changes] == ["description"]


def test_a_run_that_ends_earlier_lacks_messages(kept: Make) -> None:
    a, b = kept(), kept(duration="1.5 s")
    found = compare(a, b)
    first = found.first[0]
    assert (first.field, first.a, first.b) == ("", "message", None)
    assert 1_500_000_000 <= first.time_ns <= 1_520_000_000
    assert compare(b, a).first[0].b == "message"


def test_without_the_files_of_then_the_hashes_still_name_second_and_topics(
    tmp_path: Path, kept: Make
) -> None:
    robot = tmp_path / "robot.urdf.xacro"
    shipped = twin.load_robot("diff_bot").description.source
    shutil.copy(shipped, robot)
    a = kept(robots__0__model=str(robot), robots__0__name="diff_bot")
    changed = robot.read_text("utf-8").replace('"wheel_radius" value="0.05"', '"wheel_radius" value="0.051"')
    assert changed != robot.read_text("utf-8")
    robot.write_text(changed, encoding="utf-8")

    found = compare(a, made_again(a))

    assert not found.same
    assert (found.second, found.first) == (0, ())
    assert "/odom nav_msgs/msg/Odometry" in found.topics
    (note,) = found.notes
    assert note.startswith(
        f"{a.name}, made again, is another run from second 0 on: since then changed: file "
    )
    assert "robot.urdf.xacro (" in note


def test_a_script_that_took_part_is_not_kept(arcs: Path, tmp_path: Path) -> None:
    with twin.Simulation(arcs, out=tmp_path / "driven", record=False) as simulation:
        simulation.run_until(1.5)
        simulation.publish("cmd_vel", {})
    a = of_path(tmp_path / "driven")
    found = compare(a, made_again(a))
    assert not found.same
    assert found.notes == (
        f"{a.name}, made again, is another run from second 1 on: something took part that is not kept",
    )


@pytest.mark.parametrize(
    ("change", "why"),
    [({"clock": "free"}, "other processes took part"), ({"scenario": {}}, "was not read from a file")],
)
def test_what_is_not_known_whole_is_not_made_again(kept: Make, change: dict[str, Any], why: str) -> None:
    a = kept()
    unknown = replace(a, run=replace(a.run, provenance=replace(a.run.provenance, **change)))
    with pytest.raises(RecordingError, match=why):
        made_again(unknown)
    found = compare(unknown, kept(seed=2))
    assert found.second == 0
    assert why in found.notes[0]


def test_other_versions_are_named(kept: Make) -> None:
    made = kept().run.provenance
    older = replace(made, versions={**made.versions, "mujoco": "3.1.4"}, cpu="an abacus")
    assert list(since(made)) == []
    assert [text.partition(" (")[0] for text in since(older)] == ["version of mujoco", "cpu"]


@pytest.mark.parametrize("content", ["", "{}", "[1]", '{"provenance": {"x": 1}}'])
def test_a_file_that_is_none_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / HASHES).write_text(content, encoding="utf-8")
    with pytest.raises(RecordingError, match="not the hashes of a run"):
        of_path(tmp_path)


def test_a_folder_without_is_told(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="no such file; `twin run` writes it"):
        of_path(tmp_path)


def test_json_has_all_that_was_found() -> None:
    one = Divergence(topic="/a", type="b", time_ns=1, tick=1, field="x", a=1.0, b=3.0)
    found = Difference(a="a", b="b", digest_a="1", digest_b="2", same=False, first=(one,))
    values = json.loads(json.dumps(found.to_dict()))
    assert values["first"][0]["change"] == 2.0
    assert values["same"] is False


def test_a_run_that_broke_off_keeps_hashes(arcs: Path, tmp_path: Path) -> None:
    simulation = twin.Simulation(arcs, out=tmp_path / "broken", record=False)
    simulation.run_until(1.5)
    simulation.close()
    kept = KeptRun.read(tmp_path / "broken" / HASHES)
    assert kept.digest is None
    assert len(kept.hashes.stream) == 2
