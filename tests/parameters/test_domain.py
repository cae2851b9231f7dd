from __future__ import annotations

import math
import re
from typing import Annotated, Any, Literal

import numpy as np
import pytest
from annotated_types import Len

from twin.parameters import (
    Amperes,
    Hertz,
    Interval,
    Joules,
    Kilograms,
    MayBeInfinite,
    Metres,
    MetresPerSecond,
    MetresPerSecondSquared,
    Newtons,
    NotPositive,
    Positive,
    Radians,
    RadiansPerSecond,
    RadiansPerSecondSquared,
    Seconds,
    SquareMetres,
)
from twin.parameters.domain import Domain, domain_of


@pytest.mark.parametrize("hint", [Annotated[Metres, Positive], Annotated[float, Metres, Positive]])
def test_a_unit_holds_wherever_it_stands_in_the_annotation(hint: object) -> None:
    domain = domain_of(hint)
    assert domain is not None
    assert domain.unit is not None
    assert domain.unit.si == "m"
    assert domain.said == "must be greater than 0"


Point = tuple[Annotated[Metres, Interval(ge=-1, le=1)], Annotated[Metres, Interval(ge=-1, le=1)]]


@pytest.mark.parametrize(
    ("hint", "valid", "refused"),
    [
        (
            Annotated[float, Positive],
            [1e-100, 1e15, 2],
            [0.0, -1.0, 1.1e15, 0.9e-100, math.inf, math.nan, "1", True],
        ),
        (Annotated[int, Interval(ge=2, lt=5)], [2, 4], [1, 5, 2.0, True]),
        (Annotated[int, Positive], [1, 10**30], [0]),
        (Annotated[float, NotPositive, MayBeInfinite], [0.0, -math.inf], [1e-9, math.nan]),
        (Metres, [0.0, 1e12, -1e-100], [1.1e12, 1e-101, "1 m"]),
        (Seconds, [1e-9, 1e9], [0.9e-9, 1.1e9]),
        (bool, [True, False], [0, 1, "true"]),
        (Literal["a", "b"], ["a"], ["c", "A", 1]),
        (str | None, ["", None], [1]),
        (float, [1.0], [None]),
        (tuple[float, ...], [(), (1.0,), [1.0, 2.0]], [1.0, (1.0, "2"), "12"]),
        (Point, [(1.0, 0.9), (-1, 0)], [(1.5, 0.0), (0.0, -1.5), (1.0,), (1.0, 1.0, 1.0)]),
        (Annotated[tuple[int, ...], Len(1, 2)], [(1,), (1, 2)], [(), (1, 2, 3)]),
    ],
)
def test_which_values_a_type_takes(hint: Any, valid: list[Any], refused: list[Any]) -> None:
    domain = domain_of(hint)
    assert domain is not None
    for value in valid:
        found = domain.checked(value)
        assert found == (tuple(value) if isinstance(value, list) else value)
        assert domain.kind is not float or found is None or type(found) is float
    for value in refused:
        with pytest.raises(ValueError, match="must"):
            domain.checked(value)


@pytest.mark.parametrize(
    ("hint", "value", "words"),
    [
        (Annotated[float, Interval(gt=0, le=10)], 11.0, "must be greater than 0 and at most 10, not 11.0"),
        (Annotated[int, Interval(ge=1, lt=3)], 3, "must be at least 1 and less than 3, not 3"),
        (int, 1.5, "must be a whole number, not 1.5"),
        (Metres, 1e13, "must be 0, or from 1e-100 to 1e+12 m in size, not 10000000000000.0"),
        (float, -1e16, "must be 0, or from 1e-100 to 1e+15 in size, not -1e+16"),
        (Annotated[float, Positive], math.inf, "must be greater than 0 and finite, not inf"),
        (float, math.nan, "must be finite, not nan"),
        (Literal[1, 2], 3, "must be 1 or 2, not 3"),
        (Point, (0.0,), "must have 2 values, not 1"),
        (Annotated[tuple[int, ...], Len(1, 2)], (), "must have at least 1 values, not 0"),
        (Annotated[tuple[int, ...], Len(1, 2)], (1, 2, 3), "must have at most 2 values, not 3"),
        (Point, 7, "must be a list, not 7"),
    ],
)
def test_what_is_said_of_a_value_that_is_none(hint: Any, value: Any, words: str) -> None:
    domain = domain_of(hint)
    assert domain is not None
    with pytest.raises(ValueError, match=f"^{re.escape(words)}$"):
        domain.checked(value)


def test_what_is_no_parameter_has_no_domain() -> None:
    for hint in (Domain, np.ndarray, tuple[Domain, ...], Any, dict[str, float]):
        assert domain_of(hint) is None
    position, listed = domain_of(Point), domain_of(tuple[Metres, ...])
    assert position is not None
    assert listed is not None
    assert (position.is_fixed, position.lengths) == (True, (2, 2))
    assert (listed.is_fixed, listed.lengths) == (False, (0, None))
    assert position.said == "each must be at least -1 and at most 1"


@pytest.mark.parametrize(
    ("unit", "text", "value"),
    [
        (Metres, "12 cm", 0.12),
        (Metres, "-3mm", -0.003),
        (Metres, "1.5e-1km", 150.0),
        (Metres, "7 m", 7.0),
        (Seconds, "0.1 ms", 1e-4),
        (Seconds, "3 us", 3e-6),
        (Seconds, "1.5 min", 90.0),
        (Seconds, "2 h", 7200.0),
        (Radians, "180 deg", math.pi),
        (Radians, "-90°", -math.pi / 2.0),
        (Kilograms, "250 g", 0.25),
        (Kilograms, "2 t", 2000.0),
        (MetresPerSecond, "36 km/h", 10.0),
        (MetresPerSecond, "5 cm/s", 0.05),
        (MetresPerSecond, "5 mm/s", 0.005),
        (RadiansPerSecond, "60 rpm", 2.0 * math.pi),
        (RadiansPerSecond, "90 deg/s", math.pi / 2.0),
        (RadiansPerSecondSquared, "90 deg/s^2", math.pi / 2.0),
        (MetresPerSecondSquared, "2 m/s²", 2.0),
        (Newtons, "3 kN", 3000.0),
        (Newtons, "3 mN", 0.003),
        (Hertz, "2 kHz", 2000.0),
        (Joules, "1 Wh", 3600.0),
        (Joules, "2 kWh", 7.2e6),
        (Joules, "2 kJ", 2000.0),
        (SquareMetres, "3 cm²", 3e-4),
        (Amperes, "5 mA", 0.005),
    ],
)
def test_text_with_a_unit_is_its_value_in_si(unit: Any, text: str, value: float) -> None:
    """BIPM, The International System of Units, 9th edition, tables 7 and 8."""
    domain = domain_of(unit)
    assert domain is not None
    assert domain.parsed(text) == pytest.approx(value, rel=1e-15)
    for other in ("1 parsec", "1", "m", "1 2 m"):
        with pytest.raises(ValueError, match="unit"):
            domain.parsed(other)
