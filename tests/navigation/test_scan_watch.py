"""Which scans may be driven by."""

from __future__ import annotations

import numpy as np
import pytest

from twin.geometry import Array, Pose2
from twin.navigation.scan_watch import RepeatedScan, ScanWatch

SCAN = np.linspace(1.0, 3.0, 90)
NOTHING = np.full(90, np.inf)


def at(x: float) -> Pose2:
    return Pose2(x, 0.0, 0.0)


def test_the_same_scan_again_is_old_only_if_the_robot_has_moved() -> None:
    watch = ScanWatch()
    assert [watch.fault(SCAN, at(0.0)) for _ in range(20)] == [""] * 20, "it stands; the lidar has no noise"
    assert watch.fault(SCAN, at(0.2)) == "it stays the same while the robot moves"
    assert watch.fault(SCAN, at(0.2)), "and stays old while the robot stands there"
    assert watch.fault(SCAN + 0.001, at(0.2)) == "", "until another one comes"


def test_one_scan_twice_on_the_way_is_no_fault() -> None:
    watch = ScanWatch()
    assert [watch.fault(SCAN + i // 2, at(0.1 * i)) for i in range(10)] == [""] * 10


@pytest.mark.parametrize("odom", [at(0.0), None])
def test_nan_is_no_scan_but_single_ones_are_borne(odom: Pose2 | None) -> None:
    watch = ScanWatch()
    broken = SCAN.copy()
    broken[10:60] = np.nan
    assert watch.fault(broken, odom) == ""
    assert watch.fault(np.full(90, np.nan), odom) == "every reading is NaN"


def test_nothing_returns_in_the_open_but_not_from_one_scan_to_the_next() -> None:
    open_field = ScanWatch()
    assert [open_field.fault(NOTHING, at(0.1 * i)) for i in range(10)] == [""] * 10
    watch = ScanWatch()
    assert watch.fault(SCAN, at(0.0)) == ""
    assert [watch.fault(NOTHING, at(0.1 * i)) for i in range(5)] == ["suddenly no ray returns"] * 5
    leaving = np.where(np.arange(90) < 10, SCAN, np.inf)
    assert watch.fault(leaving, at(0.5)) == "", "something is seen again"
    assert watch.fault(NOTHING, at(0.6)) == "", "and drops out of sight little by little"


def test_what_is_too_near_is_seen() -> None:
    watch = ScanWatch()
    assert watch.fault(SCAN, at(0.0)) == ""
    assert watch.fault(np.full(90, -np.inf), at(0.0)) == ""


@pytest.mark.parametrize(
    "other", [SCAN, SCAN + 0.001, SCAN[:-1], np.where(SCAN < 1.5, np.nan, SCAN), NOTHING]
)
def test_a_scan_is_the_same_if_numpy_says_so(other: Array) -> None:
    for scan in (SCAN, other):
        watch = RepeatedScan(1, 0.0)
        assert not watch.is_frozen(scan, at(0.0))
        assert watch.is_frozen(other.copy(), at(0.0)) == np.array_equal(scan, other, equal_nan=True)
