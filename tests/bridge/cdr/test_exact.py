"""A message that is exact is one that nobody can tell from what its bytes are decoded to."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.bridge.cdr.test_all_types import NAMES, messages
from twin.bridge import types
from twin.bridge.cdr.codec import codec
from twin.bridge.cdr.exact import exactness
from twin.bridge.msgs import (
    ColorRGBA,
    DiagnosticStatus,
    Float64,
    JointState,
    LaserScan,
    Point,
    Pose,
    PoseArray,
    PoseStamped,
    String,
    Time,
    Twist,
    Vector3,
    new,
)
from twin.bridge.types.fields import fields_of


def received(message: Any) -> Any:
    one = codec(type(message))
    return one.decode(one.encode(message))


def exact(message: Any) -> bool:
    return exactness(message.__msgtype__)(message)


def texts_of(message: Any) -> Iterator[str]:
    for field in fields_of(message.__msgtype__):
        value = getattr(message, field.attribute)
        for item in value if isinstance(value, list) else [value]:
            if field.message:
                yield from texts_of(item)
            elif isinstance(item, str):
                yield item


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_what_was_received_is_exact(data: st.DataObject) -> None:
    message = received(data.draw(messages(data.draw(st.sampled_from(NAMES)))))
    assert exact(message) is all(map(str.isascii, texts_of(message)))


def read_only(*values: float, dtype: type = np.float32) -> Any:
    array = np.array(values, dtype)
    array.flags.writeable = False
    return array


@pytest.mark.parametrize(
    "message",
    [
        new(Float64, data=float("nan")),
        Vector3(-0.0, float("inf"), 5e-324),
        new(ColorRGBA, r=0.5, g=-0.0, b=float("inf"), a=1.0),
        new(LaserScan, ranges=read_only(1, np.nan, np.inf), intensities=read_only()),
        Time(-(2**31), 2**32 - 1),
        new(DiagnosticStatus, level=-1, name="a"),
    ],
)
def test_it_is_received_as_it_is(message: Any) -> None:
    assert exact(message)
    assert repr(received(message)) == repr(message)


class Name(str):
    """A text, but not quite."""


@pytest.mark.parametrize(
    "message",
    [
        Vector3(0, 0.0, 0.0),
        Vector3(np.float64(1.0), 0.0, 0.0),
        Vector3(0.0, 0.0, True),
        new(ColorRGBA, r=0.1),
        new(ColorRGBA, r=1e300),
        new(ColorRGBA, r=float("nan")),
        Time(2**31, 0),
        Time(0, -1),
        Time(True, 0),
        Time(np.int32(1), 0),  # type: ignore[arg-type]
        new(DiagnosticStatus, level=200),
        new(String, data="é"),
        new(String, data=Name("a")),
        new(String, data=None),
        new(Twist, linear=Point(0.0, 0.0, 0.0)),
        new(PoseArray, poses=(new(Pose),)),
        new(PoseArray, poses=[new(Pose), new(PoseStamped)]),
        new(PoseArray, poses=[Pose(Point(0, 0.0, 0.0), new(Pose).orientation)]),
        new(JointState, name=["a", Name("b")]),
        new(JointState, name=("a",)),
        new(JointState, position=[1.0]),  # type: ignore[arg-type]
        new(LaserScan, ranges=np.zeros(3, np.float32), intensities=read_only()),
        new(LaserScan, ranges=read_only(1, dtype=np.float64), intensities=read_only()),
        new(LaserScan, ranges=read_only(1, 2, 3)[::2], intensities=read_only()),
        new(LaserScan, ranges=read_only(1, 2, 3)[:, None], intensities=read_only()),
        new(types.get("test_msgs/msg/BoundedPlainSequences"), bool_values=read_only(0, 1, 1, 1, dtype=bool)),
        new(types.get("test_msgs/msg/Strings"), bounded_string_value="a" * 23),
    ],
)
def test_what_would_be_received_otherwise_is_not_exact(message: Any) -> None:
    assert not exact(message)
