"""Impossible inertias: rigid bodies move as the file says, or nearly, or the file is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from twin.errors import ModelError
from twin.models import ReadOptions
from twin.models.description import RobotDescription
from twin.models.dynamics import mass_matrix_and_gravity
from twin.models.loader import parse_urdf
from twin.models.mass_properties import MassProperties, inertia_fault, nearest_possible

PLATE = "<inertia ixx='0.01' iyy='0.01' izz='0.1'/>"
CUBE = "<inertia ixx='0.1' iyy='0.1' izz='0.1'/>"


def inertial(mass: float, inertia: str, xyz: str = "0 0 0") -> str:
    return f"<inertial><origin xyz='{xyz}'/><mass value='{mass}'/>{inertia}</inertial>"


def robot(tip: str, eye: str, *, repair: bool = False) -> RobotDescription:
    """Return a base, a tip on a hinge, and an eye fixed to the tip, in lines 2, 4 and 6."""
    base = inertial(1, CUBE)
    text = f"""<robot name='r'>
      <link name='base'>{base}</link>
      <joint name='j' type='continuous'><parent link='base'/><child link='tip'/><axis xyz='0 1 0'/></joint>
      <link name='tip'>{tip}</link>
      <joint name='f' type='fixed'><origin rpy='1 2 3'/><parent link='tip'/><child link='eye'/></joint>
      <link name='eye'>{eye}</link>
    </robot>"""
    return parse_urdf(text, Path("r.urdf"), ReadOptions(repair=repair))


def moment(description: RobotDescription) -> float:
    return float(mass_matrix_and_gravity(description, {"j": 0.4})[0][0, 0])


def test_an_impossible_part_is_lumped_into_what_carries_it() -> None:
    description = robot(inertial(2, CUBE), inertial(0.1, PLATE, "0 0.2 0"))
    settled = description.settlement
    assert settled.lumped == {"eye": "tip"}
    assert set(settled.bodies) == {"base", "tip"}
    assert settled.bodies["tip"].mass == pytest.approx(2.1)
    assert not settled.repaired


def test_a_massless_carrier_takes_its_part() -> None:
    settled = robot("", inertial(0.1, CUBE.replace("izz='0.1'", "izz='0.2001'"))).settlement
    assert settled.lumped == {"eye": "tip"}
    assert settled.repaired["tip"].fault is None  # a matter of rounding


def test_a_moving_part_with_an_impossible_inertia_is_refused_with_its_line() -> None:
    with pytest.raises(ModelError) as caught:
        robot(inertial(2, PLATE), "")
    (problem,) = caught.value.problems
    assert (problem.line, problem.code, problem.element) == (4, "impossible-inertia", "link 'tip'")
    assert "0.01, 0.01, 0.1 kg m²" in problem.message
    assert "give --repair" in problem.message


def test_the_whole_is_refused_if_no_part_saves_it() -> None:
    with pytest.raises(ModelError, match="link 'tip', with eye fixed to it, has an impossible inertia"):
        robot(inertial(1, PLATE), inertial(1e-3, PLATE))


def test_repair_takes_the_nearest_and_says_so() -> None:
    description = robot(inertial(2, PLATE), "", repair=True)
    settled = description.settlement
    assert settled.repaired["tip"].fault
    assert inertia_fault(settled.bodies["tip"].inertia) is None
    # 0.08 too much is spread over three moments
    np.testing.assert_allclose(
        np.diag(settled.bodies["tip"].inertia), [0.01 + 0.08 / 3, 0.01 + 0.08 / 3, 0.1 - 0.08 / 3], rtol=1e-6
    )


def test_zeros_for_mass_and_inertia_are_a_mere_frame() -> None:
    nothing = inertial(0, "<inertia ixx='0' iyy='0' izz='0'/>")
    assert robot(inertial(2, CUBE), nothing).links["eye"].inertial is None


def test_inertia_without_mass_counts() -> None:
    description = robot(inertial(2, CUBE), inertial(0, CUBE))
    assert description.settlement.bodies["tip"].mass == 2.0
    assert moment(description) == pytest.approx(0.2, abs=1e-12)


def test_a_point_mass_is_taken_as_it_is() -> None:
    point = inertial(2, "<inertia ixx='0' iyy='0' izz='0'/>", "0.5 0 0")
    settled = robot(point, "").settlement
    assert settled.repaired["tip"].fault is None
    assert np.max(settled.bodies["tip"].inertia) < 1e-9


def test_massless_links_that_carry_others_stand_in() -> None:
    chain = "<joint name='k' type='continuous'><parent link='tip'/><child link='end'/></joint>"
    text = robot(inertial(1, CUBE), "").urdf.replace(inertial(1, CUBE), "", 2)
    text = text.replace("</robot>", f"{chain}<link name='end'>{inertial(1, CUBE)}</link></robot>")
    description = parse_urdf(text, Path("r.urdf"))
    assert description.settlement.massless_carriers == {"tip"}


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6), st.floats(0.01, 10.0))
def test_nearest_possible_is_possible_and_nearest(elements: list[float], mass: float) -> None:
    lower = np.zeros((3, 3))
    lower[np.tril_indices(3)] = elements
    given_inertia = lower + lower.T
    body = MassProperties(mass=mass, com=np.zeros(3), inertia=given_inertia)
    found = nearest_possible(body).inertia
    assert inertia_fault(found) is None

    # an oracle that knows nothing of moments: J = tr(S) 1 - S for S = L Lᵀ, over all L
    def distance(x: np.ndarray) -> float:
        L = np.zeros((3, 3))
        L[np.tril_indices(3)] = x
        S = L @ L.T
        return float(np.linalg.norm(np.trace(S) * np.eye(3) - S - given_inertia))

    best = min(
        minimize(distance, start, method="L-BFGS-B").fun
        for start in (np.full(6, 0.3), np.eye(3)[np.tril_indices(3)])
    )
    assert np.linalg.norm(found - given_inertia) <= best + 1e-4
