"""What a run does to Python's garbage collection ends with it."""

from __future__ import annotations

import gc
from contextlib import suppress

import pytest

from twin.savings import seldom_collected


@pytest.mark.parametrize("often", [0, 700, 50_000])
def test_garbage_is_looked_for_less_often_never_more_and_then_as_before(often: int) -> None:
    before = gc.get_threshold()
    gc.set_threshold(often, 7, 8)
    try:
        with suppress(KeyError), seldom_collected():
            during = gc.get_threshold()
            assert gc.get_freeze_count() > 0
            raise KeyError
        assert (during[0] == 0) if not often else (during[0] >= max(often, 10_000))
        assert gc.get_threshold() == (often, 7, 8)
        assert gc.get_freeze_count() == 0
    finally:
        gc.set_threshold(*before)
