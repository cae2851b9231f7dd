"""Twenty clients that hear everything, for a minute."""

from __future__ import annotations

import pytest

from benchmarks.measures import web_cost


@pytest.mark.long
def test_they_are_served_stops_arrive_and_memory_does_not_grow() -> None:
    costs = web_cost.measure(60.0)
    assert costs.topics > 40
    assert costs.frames > 10 * web_cost.KEPT_S
    assert len(costs.stops_ms) == web_cost.STOPS, "each of them arrived among a thousand messages a second"
    assert max(costs.memory_mb) < costs.memory_mb[0] + 20.0
