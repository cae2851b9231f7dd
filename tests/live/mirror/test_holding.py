"""What two grippers hold."""

from __future__ import annotations

from twin.live.mirror.holding import Holding

MS = 1_000_000


def told(holding: Holding, begin_ms: int, end_ms: int, *, physical: bool, virtual: str | None) -> list[str]:
    said = [
        holding.update(time * MS, physical=physical, virtual=virtual) for time in range(begin_ms, end_ms, 20)
    ]
    return [text for text in said if text is not None]


def test_grippers_that_agree_say_nothing_and_one_may_be_late() -> None:
    holding = Holding()
    assert told(holding, 0, 1000, physical=False, virtual=None) == []
    assert told(holding, 1000, 2400, physical=True, virtual=None) == []
    assert told(holding, 2400, 9000, physical=True, virtual="tote_a") == []


def test_a_difference_that_lasts_is_told_once_and_so_is_its_end() -> None:
    holding = Holding()
    assert told(holding, 0, 9000, physical=True, virtual=None) == [
        "the physical gripper holds something, the virtual one nothing"
    ]
    assert holding.differ
    assert told(holding, 9000, 12000, physical=True, virtual="tote_a") == [
        "both grippers agree again: they hold tote_a"
    ]
    assert told(holding, 12000, 15000, physical=False, virtual="tote_a") == [
        "the virtual gripper holds tote_a, the physical one nothing"
    ]
