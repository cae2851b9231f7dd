from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
import pytest

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import ParameterEvent
from twin.errors import BridgeError
from twin.geometry import Array
from twin.navigation.control.dwb.config import DWBConfig
from twin.navigation.docking.docks import DockType
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.nodes.navigation.controller_server.config import ControllerServerConfig
from twin.nodes.node_parameters import declare_config
from twin.parameters import (
    DurationNs,
    Interval,
    MayBeInfinite,
    MetresPerSecond,
    Name,
    NotNegative,
    PeriodNs,
)


@dataclass(frozen=True, kw_only=True)
class Limits:
    speed: Annotated[MetresPerSecond, NotNegative] = 1.0
    """How fast."""
    cap: Annotated[float, MayBeInfinite] = float("inf")
    free: float | None = None

    def __post_init__(self) -> None:
        if self.speed > 5.0:
            raise ValueError("nothing is that fast")


@dataclass(frozen=True, kw_only=True)
class Config:
    limits: Annotated[Limits, Name("FollowPath")] = field(default_factory=Limits)
    controller_period_ns: Annotated[PeriodNs, Interval(gt=0, le=1000)] = 50_000_000
    timeout_ns: DurationNs = 300_000_000
    joints: tuple[str, ...] = ("a", "b")
    corners: Array = field(default_factory=lambda: np.zeros((1, 2)))


@pytest.fixture
def bus() -> Iterator[Bus]:
    with Bus.open(Clock()) as opened:
        yield opened


def test_a_config_can_be_read_and_replaced(bus: Bus) -> None:
    events: list[ParameterEvent] = []
    bus.create_node("watch").create_subscription(ParameterEvent, "/parameter_events", events.append, 100)
    node, seen = bus.create_node("n"), []
    declare_config(node, Config(), seen.append)
    values = {p.name: p.value for p in node.get_parameters(node.list_parameters().names[2:])}
    assert values == {
        "FollowPath.speed": 1.0,
        "FollowPath.cap": float("inf"),
        "controller_frequency": 20.0,
        "timeout": pytest.approx(0.3),
        "joints": ["a", "b"],
    }
    node.set_parameter("FollowPath.speed", 2)
    node.set_parameter("controller_frequency", 10.0)
    assert (seen[-1].limits.speed, seen[-1].controller_period_ns) == (2.0, 100_000_000)
    for name, value, why in (
        ("FollowPath.speed", 6.0, "nothing is that fast"),
        ("FollowPath.speed", -1.0, "FollowPath.speed must be at least 0, not -1.0"),
        ("FollowPath.speed", float("nan"), "FollowPath.speed must be at least 0, not nan"),
        ("controller_frequency", 0.0, "must be greater than 0 and at most 1000, not 0.0"),
    ):
        with pytest.raises(BridgeError, match=why):
            node.set_parameter(name, value)
    assert len(seen) == 2
    told = node.describe_parameter("FollowPath.speed")
    assert (told.description, told.additional_constraints) == ("How fast [m/s].", "must be at least 0")
    assert [(one.from_value, one.to_value) for one in told.floating_point_range] == [(0.0, 1e12)]
    bus.spin()
    assert [len(e.new_parameters) for e in events] == [5, 0, 0]


def test_without_a_way_to_replace_it_a_config_is_read_only(bus: Bus) -> None:
    node = bus.create_node("n")
    declare_config(node, Config())
    with pytest.raises(BridgeError, match="read-only"):
        node.set_parameter("FollowPath.speed", 2.0)


@pytest.mark.parametrize(
    ("config", "name", "value"),
    [
        (DWBConfig(), "min_vel_x", -0.2),
        (DockType(), "staging_yaw_offset", -1.57),
        (ControllerServerConfig(), "failure_tolerance", -1.0),
        (AmclConfig(), "laser_max_range", -1.0),
    ],
)
def test_what_is_negative_in_nav2_too_may_become_so(
    bus: Bus, config: object, name: str, value: float
) -> None:
    node, seen = bus.create_node("n"), []
    declare_config(node, config, seen.append)
    assert node.get_parameter(name).value >= 0.0
    node.set_parameter(name, value)
    assert node.get_parameter(name).value == value
    assert seen
