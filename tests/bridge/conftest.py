from __future__ import annotations

from collections.abc import Iterator

import pytest

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def bus(clock: Clock) -> Iterator[Bus]:
    with Bus.open(clock) as opened:
        yield opened
