"""What is varied, as it is typed."""

from __future__ import annotations

import pytest

from twin.errors import ScenarioError
from twin.experiments.sweep.axes import number, parse_axis, parse_seeds, points


@pytest.mark.parametrize(
    ("word", "values"),
    [
        ("a.b=1,2,3", ("1", "2", "3")),
        ("a.b=0.1:0.5:0.1", ("0.1", "0.2", "0.3", "0.4", "0.5")),
        ("a.b=0.1:0.55:0.2", ("0.1", "0.3", "0.5")),
        ("a.b=10:0:-5", ("10", "5", "0")),
        ("a.b=1:3:1 m", ("1 m", "2 m", "3 m")),
        ("a.b=0, 1:2:0.5 deg/s", ("0", "1 deg/s", "1.5 deg/s", "2 deg/s")),
        ("a.b={x: 1, y: 2},[3, 4]", ("{x: 1, y: 2}", "[3, 4]")),
        ("a.b='x,y',z", ("'x,y'", "z")),
        ("a.b=plan.py:A,dwb", ("plan.py:A", "dwb")),
        ("a.b=x=1", ("x=1",)),
    ],
)
def test_values_are_listed_or_counted(word: str, values: tuple[str, ...]) -> None:
    assert parse_axis(word).values == values


def test_an_interval_has_its_unit() -> None:
    axis = parse_axis("a.b=-0.5..1e1 cm")
    assert (axis.low, axis.high, axis.unit, axis.values) == (-0.5, 10.0, "cm", ())


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("a.b", "must be KEY=VALUES"),
        ("=1", "must be KEY=VALUES"),
        ("seed=1,2", "swept with --seeds"),
        ("a=1,,2", "a value is missing"),
        ("a=1,2,1", "the value 1 is there twice"),
        ("a=0:1:-0.1", "the step must lead from 0 to 1"),
        ("a=0:1:0", "the step must lead"),
        ("a=0:1:1e-9", "at most 1000000"),
        ("a=2..1", "begin with its lower end"),
    ],
)
def test_what_is_no_axis_is_told(word: str, said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        parse_axis(word)


def test_seeds_count_as_pythons_range_or_have_both_ends() -> None:
    assert parse_seeds("1..4, 7:9") == (1, 2, 3, 4, 7, 8)
    assert parse_seeds("3..3") == (3,)
    assert parse_seeds("0:4") == (0, 1, 2, 3)
    assert parse_seeds("0:10:4, 1") == (0, 4, 8, 1)
    assert parse_seeds("7") == (7,)


HUGE = ("0:9999999", "0:99999999999999999999", "9223372036854775808")
WRONG = ("", "a", "3:1", "4..1", "1..", "1,1", "0:5,4", "-1", "0:4:0", "1:2:3:4", *HUGE)


@pytest.mark.parametrize("text", WRONG)
def test_what_are_no_seeds_is_told(text: str) -> None:
    with pytest.raises(ScenarioError, match="--seeds"):
        parse_seeds(text)


def test_lists_are_combined_in_their_order() -> None:
    found = points([parse_axis("a=1,2"), parse_axis("b=x,y")], None)
    assert [tuple(point.items()) for point in found] == [
        (("a", "1"), ("b", "x")),
        (("a", "1"), ("b", "y")),
        (("a", "2"), ("b", "x")),
        (("a", "2"), ("b", "y")),
    ]
    assert points([], None) == ({},)


def test_samples_fill_every_part_of_every_interval() -> None:
    axes = [parse_axis("a=0..1"), parse_axis("n=1,2"), parse_axis("b=10..20 cm")]
    found = points(axes, 50)
    assert len(found) == 100
    assert [list(point) for point in found[:1]] == [["a", "n", "b"]]
    for key, low, width in (("a", 0.0, 0.02), ("b", 10.0, 0.2)):
        values = [number(point[key]) for point in found if point["n"] == "1"]
        parts = sorted(int((value[0] - low) / width) for value in values if value is not None)
        assert parts == list(range(50))
    assert found == points(axes, 50)


def test_intervals_and_numbers_of_samples_need_each_other() -> None:
    with pytest.raises(ScenarioError, match=r"say how often, with --sample"):
        points([parse_axis("a=0..1")], None)
    with pytest.raises(ScenarioError, match="draws from intervals"):
        points([parse_axis("a=0,1")], 5)
    with pytest.raises(ScenarioError, match="is there twice"):
        points([parse_axis("a=0,1"), parse_axis("a=2")], None)
    with pytest.raises(ScenarioError, match="8000000 combinations"):
        points([parse_axis(f"{key}=1:200:1") for key in "abc"], None)
