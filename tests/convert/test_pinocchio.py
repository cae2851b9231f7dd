"""Converted robots against pinocchio: random trees, and every robot of example-robot-data."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, reject, settings
from hypothesis import strategies as st

from twin.convert import Base, convert
from twin.errors import ConversionError
from twin.models.loader import parse_urdf

pytest.importorskip("pinocchio", reason="pinocchio is not installed (pip install pin)")
from tests.oracles.example_robots import outcomes
from tests.oracles.installed import example_robots
from tests.oracles.pinocchio_oracle import compare

TOLERANCE = 1e-5
REFUSED = {
    "romeo.urdf": "LFinger11Link",
    "romeo_laas_small.urdf": "LShoulderYaw_link",
    "romeo_small.urdf": "RShoulderYawLink",
    "ur3.urdf": "no links",
}
"""Massless fingers; moving links with impossible inertias, twice; a robot without links."""
KINDS = ("fixed", "revolute", "continuous", "prismatic", "planar", "floating")
numbers = st.integers(-200, 200).map(lambda value: value / 100)
vectors = st.tuples(numbers, numbers, numbers)


def origin(xyz: tuple[float, ...], rpy: tuple[float, ...]) -> str:
    return f"<origin xyz='{' '.join(map(str, xyz))}' rpy='{' '.join(map(str, rpy))}'/>"


@st.composite
def inertials(draw: Any) -> str:
    """Return the inertial of four random point masses."""
    mass = draw(st.integers(1, 200)) / 10
    points = np.array([draw(vectors) for _ in range(4)]) + 0.3 * np.eye(4, 3)
    J = mass * (np.mean(np.sum(points**2, axis=1)) * np.eye(3) - points.T @ points / len(points))
    named = {"ixx": J[0, 0], "ixy": J[0, 1], "ixz": J[0, 2], "iyy": J[1, 1], "iyz": J[1, 2], "izz": J[2, 2]}
    moments = " ".join(f"{name}='{float(value)!r}'" for name, value in named.items())
    place = origin(draw(vectors), draw(vectors))
    return f"<inertial>{place}<mass value='{mass}'/><inertia {moments}/></inertial>"


@st.composite
def trees(draw: Any) -> str:
    """Return a robot of up to nine links; some of those that carry others are massless."""
    size = draw(st.integers(2, 9))
    parents = [draw(st.integers(0, child - 1)) for child in range(1, size)]
    text = ["<robot name='tree'>"]
    for link in range(size):
        massless = link in parents and draw(st.integers(0, 3)) == 0
        text.append(f"<link name='l{link}'>{'' if massless else draw(inertials())}</link>")
    for child, parent in enumerate(parents, start=1):
        kind = draw(st.sampled_from(KINDS))
        axis = draw(vectors.filter(lambda axis: max(map(abs, axis)) > 0.1))
        if kind == "planar":
            axis = (0.0, 0.0, 1.0)  # pinocchio takes no other
        text.append(
            f"<joint name='j{child}' type='{kind}'>{origin(draw(vectors), draw(vectors))}"
            f"<parent link='l{parent}'/><child link='l{child}'/><axis xyz='{' '.join(map(str, axis))}'/>"
            "<limit lower='-2' upper='1' effort='1' velocity='1'/></joint>"
        )
    return "\n".join([*text, "</robot>"])


@settings(
    max_examples=60,
    deadline=None,
    derandomize=True,
    phases=(Phase.explicit, Phase.generate),  # to shrink a tree takes minutes
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
@given(text=trees(), base=st.sampled_from(("free", "fixed")))
def test_random_trees(text: str, base: Base) -> None:
    description = parse_urdf(text, Path("tree.urdf"))
    try:
        conversion = convert(description, base=base)
    except ConversionError as fault:
        # A massless link between two joints that can cancel each other is rightly refused.
        if {problem.code for problem in fault.problems} != {"massless"}:
            raise
        reject()
    assert compare(conversion.spec.compile(), description).worst < 1e-7


@pytest.mark.slow
@pytest.mark.skipif(not example_robots(), reason="example-robot-data is not installed")
@pytest.mark.parametrize("base", ["free", "fixed"])
def test_example_robots(base: Base) -> None:
    found = list(outcomes(base))
    assert len(found) == 69
    off = {item.file.name: item.errors for item in found if item.errors and item.errors.worst > TOLERANCE}
    assert off == {}
    refused = {item.file.name: item.refusal for item in found if item.refusal}
    assert refused.keys() == REFUSED.keys()
    for file, named in REFUSED.items():
        assert named in refused[file]
