"""Whatever number a live parameter is set to while a robot drives: it is refused, or the run goes on."""

from __future__ import annotations

import math
import resource
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from twin.bridge.node import Node
from twin.bridge.parameters.values import Type
from twin.errors import BridgeError, TwinError
from twin.runtime.build import build
from twin.runtime.run import Run
from twin.scenario.schema import load

SCENARIO = Path(__file__).parents[2] / "scenarios" / "warehouse.yaml"
ENDLESS = {
    "duration": "10 h",
    "mission": "{type: random_goals, robot: warehouse_bot, distance: 100 km, max_failed: 1000000}",
    "checks": "[{energy: {max: 1e9}}]",
}
_NUMBERS = (0.0, -1.0, math.nan, math.inf, 1e12)
_TICKS = {"regulated_pure_pursuit": 25, "mppi": 4, "dwb": 4}
"""Controller -> how long each value holds: with one of them half a second, in which every node has its turn;
with the others, of which the controller's own are tried, a control period."""
_GIGABYTE_KB = 1_000_000


def _values(node: Node, name: str) -> Iterator[float]:
    described = node.describe_parameter(name)
    is_whole = described.type == Type.INTEGER.value
    for valid in (*described.floating_point_range, *described.integer_range):
        yield from (valid.from_value, valid.to_value)
    yield from (
        int(value) if is_whole else value for value in _NUMBERS if math.isfinite(value) or not is_whole
    )


def _started(plugin: str) -> Run:
    scenario = load(SCENARIO, {**ENDLESS, "robots.0.navigation.controller.plugin": plugin})
    run = Run(scenario, build(scenario))
    for _ in range(150):
        run.tick()
    return run


def _harm(run: Run, node: Node, name: str, value: float, ticks: int) -> str:
    """Return what became of a run by a value; '' if it was refused or did no harm."""
    before = node.get_parameter(name).value
    try:
        try:
            node.set_parameter(name, value)
        except BridgeError:
            return ""
        for _ in range(ticks):
            started = time.process_time()
            run.tick()
            took = time.process_time() - started
            if took > 1.0:
                return f"a tick took {took:.1f} s"
        node.set_parameter(name, before)
        run.tick()
    except (
        ArithmeticError,
        ValueError,
        TypeError,
        LookupError,
        MemoryError,
        AssertionError,
        TwinError,
    ) as error:
        return repr(error)
    return ""


@pytest.mark.long
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("plugin", ["regulated_pure_pursuit", "mppi", "dwb"])
def test_no_live_value_ends_a_run(plugin: str) -> None:
    run = _started(plugin)
    harms, tried = [], 0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:
        nodes = [one.fully_qualified_name for one in run.bus.nodes]
        for node in nodes if plugin == "regulated_pure_pursuit" else ["/controller_server"]:
            found = next(one for one in run.bus.nodes if one.fully_qualified_name == node)
            for name in found.list_parameters().names:
                described = found.describe_parameter(name)
                if described.read_only or described.type not in (Type.INTEGER.value, Type.DOUBLE.value):
                    continue
                for value in _values(found, name):
                    tried += 1
                    harm = _harm(run, found, name, value, _TICKS[plugin])
                    if harm:
                        harms.append(f"{node} {name} = {value!r}: {harm}")
                        run.bus.close()
                        run = _started(plugin)
                        found = next(one for one in run.bus.nodes if one.fully_qualified_name == node)
    finally:
        run.bus.close()
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - peak
    assert tried > 60
    assert not harms, "\n".join(harms)
    assert grown < _GIGABYTE_KB, f"memory grew by {grown / 1000:.0f} MB"
