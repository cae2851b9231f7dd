"""The order and the rates of a tick."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import pytest

from twin.errors import ScenarioError
from twin.runtime.run import Run
from twin.scenario.schema import Scenario

IDLE = """
name: idle
duration: 2 s
robots: [{model: diff_bot}]
checks: [{odometry_drift: {max: 1 m}}]
"""


def test_phases_run_once_a_tick_in_the_documented_order(
    scenario: Callable[[str], Scenario], make_run: Callable[..., Run], monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[str] = []
    for phase in Run.PHASES:
        original = getattr(Run, phase)

        def spy(self: Run, phase: str = phase, original: Callable[[Run], None] = original) -> None:
            calls.append(phase)
            original(self)

        monkeypatch.setattr(Run, phase, spy)
    run = make_run(scenario(IDLE))
    run.tick()
    run.tick()
    assert calls == ["admit", "nodes", "actuate", "step", "sense", "clock", "sinks"] * 2
    assert run.world.step_count == 20, "a tick of 20 ms is ten physics steps of 2 ms"


def test_topics_come_at_their_rates_and_stamped_with_the_time_of_the_state(
    scenario: Callable[[str], Scenario], make_run: Callable[..., Run]
) -> None:
    counts: Counter[str] = Counter()
    stamps: dict[str, int] = {}

    def tap(sample: object) -> None:
        counts[sample.topic] += 1  # type: ignore[attr-defined]
        header = getattr(sample.message, "header", None)  # type: ignore[attr-defined]
        if header is not None:
            stamps[sample.topic] = header.stamp.sec * 10**9 + header.stamp.nanosec  # type: ignore[attr-defined]

    run = make_run(scenario(IDLE), taps=[tap])
    while run.world.time_ns < 1_000_000_000:
        run.tick()
    assert counts["/scan"] == 10
    assert counts["/clock"] == 50
    assert counts["/imu"] == 50
    assert counts["/odom"] in (49, 50)
    assert counts["/joint_states"] in (24, 25)
    assert counts["/robot_description"] == 1
    assert stamps["/scan"] == 1_000_000_000


def test_a_run_lasts_its_duration_when_there_is_nothing_to_do(
    scenario: Callable[[str], Scenario], make_run: Callable[..., Run]
) -> None:
    for duration, end_ns in (("2 s", 2_000_000_000), ("0.5123 s", 520_000_000)):
        run = make_run(scenario(IDLE.replace("2 s", duration)))
        while not run.over:
            run.tick()
        assert run.world.time_ns == end_ns, "to the end of the last control period"


def test_an_unknown_robot_names_the_nearest(
    scenario: Callable[[str], Scenario], make_run: Callable[..., Run]
) -> None:
    with pytest.raises(Exception, match="diff_bot") as caught:
        make_run(scenario(IDLE.replace("diff_bot", "dif_bot")))
    assert isinstance(caught.value, ScenarioError) or "ModelError" in type(caught.value).__name__
