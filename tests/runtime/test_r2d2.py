"""The tutorial's state publisher."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from twin.runtime.run import Run
from twin.scenario.schema import load

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def test_r2d2_is_on_its_circle_and_sweeps_its_joints_through_their_ranges(
    make_run: Callable[..., Run],
) -> None:
    run = make_run(load(SCENARIOS / "r2d2_circle.yaml"))
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
    assert positions[-1]["swivel"] > 3.0, "one degree a cycle, 25 cycles a second"
