"""The tutorial's state publisher."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from twin.runtime.run import Run
from twin.scenario.schema import load

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def test_r2d2_is_on_its_circle_and_sweeps_its_joints_through_their_ranges(
    make_run: Callable[..., Run],
) -> None:
    times: list[int] = []

    def tap(sample: Any) -> None:
        if sample.topic == "/position_controller/commands":
            times.append(sample.time_ns)

    def due_since(time_ns: int, tick_ns: int) -> bool:
        """Whether a 30th of a second ended in the tick that ended at a time."""
        return any(time_ns - tick_ns < k * Fraction(10**9, 30) <= time_ns for k in range(1, 241))

    run = make_run(load(SCENARIOS / "r2d2_circle.yaml"), taps=[tap])
    (stack,) = run.parts.stacks.values()
    hardware = stack.handle.hardware
    positions, radii = [], []
    while run.world.time_ns < 8_000_000_000:
        run.tick()
        positions.append(dict(zip(hardware.joint_names, hardware.read().position, strict=True)))
        radii.append(np.hypot(*run.world.pose(stack.handle.base).xyz[:2]))
    np.testing.assert_allclose(radii, 2.0, atol=1e-6)
    for joint, low, high in (("tilt", -0.5, 0.0), ("periscope", 0.0, 0.2)):
        values = [position[joint] for position in positions]
        assert min(values) < low + 0.03, joint
        assert max(values) > high - 0.03, joint
    assert math.degrees(positions[-1]["swivel"]) == pytest.approx(240.0, abs=4.0), "30 degrees a second"
    assert times == [t for t in range(0, 8_000_000_000, 20_000_000) if due_since(t, 20_000_000)]
