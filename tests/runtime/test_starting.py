"""A run tells others while its nodes are being made: nobody takes a part of its graph for the whole."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.runtime.conftest import MakeRun
from twin.bridge import live
from twin.bridge.graph import Graph, alive, starting_key
from twin.bridge.wire.session import SessionConfig
from twin.runtime import build as building
from twin.scenario.schema import Scenario

IDLE = """
name: idle
duration: 1 s
robots: [{model: diff_bot}]
mission: {type: idle}
checks: [no_collision: ]
"""


def test_a_run_says_when_all_its_nodes_are_made(
    endpoint: str,
    scenario: Callable[[str], Scenario],
    make_run: MakeRun,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen: list[list[str]] = []
    build_missions = building.build_missions

    def look(*given: object) -> object:
        with live.join([endpoint]) as other:
            seen.append(alive(other.bus, starting_key(0)))
        return build_missions(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(building, "build_missions", look)
    run = make_run(scenario(IDLE), network=SessionConfig(listen=(endpoint,)))
    assert seen == [[starting_key(0, run.bus.session_id)]]
    with live.join([endpoint]) as other:
        assert alive(other.bus, starting_key(0)) == []
        assert "/clock" in Graph.whole(other.bus).topics()
