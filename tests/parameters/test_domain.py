from __future__ import annotations

from typing import Annotated

import pytest

from twin.parameters import Metres, Positive
from twin.parameters.domain import domain_of


@pytest.mark.parametrize("hint", [Annotated[Metres, Positive], Annotated[float, Metres, Positive]])
def test_a_unit_holds_wherever_it_stands_in_the_annotation(hint: object) -> None:
    domain = domain_of(hint)
    assert domain is not None
    assert domain.unit is not None
    assert domain.unit.si == "m"
    assert domain.said == "must be greater than 0"
