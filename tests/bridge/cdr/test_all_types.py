"""Every type there and back, and every kind of nonsense: the codecs against whatever comes from outside."""

from __future__ import annotations

import contextlib
import struct
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from twin.bridge import types
from twin.bridge.cdr.codec import Codec, codec
from twin.bridge.msgs import (
    DiagnosticStatus,
    Float64MultiArray,
    Imu,
    JointState,
    JointTrajectoryPoint,
    LaserScan,
    PointCloud2,
    Pose,
    PoseArray,
    String,
    TFMessage,
    Twist,
    new,
)
from twin.bridge.types.fields import Field, fields_of
from twin.bridge.types.literals import INTEGERS, STRINGS
from twin.errors import BridgeError

types.add_folder(Path(__file__).parents[1] / "data" / "test_msgs")

texts = st.text(st.characters(exclude_characters="\0", exclude_categories=("Cs",)), max_size=6)


def parts(name: str) -> list[str]:
    suffixes = {"msg": [""], "srv": ["_Request", "_Response"], "action": ["_Goal", "_Result", "_Feedback"]}
    return [name + suffix for suffix in suffixes[types.parts(name).kind]]


NAMES = [part for name in types.names() for part in parts(name)]


def scalars(field: Field) -> st.SearchStrategy[Any]:
    if field.message:
        return messages(field.message)
    if field.base in STRINGS:
        return texts.map(lambda text: text[: field.string_bound or None])
    if field.base == "bool":
        return st.booleans()
    if field.base in INTEGERS:
        low, high = (-128, 127) if field.base == "byte" else INTEGERS[field.base]
        return st.integers(low, high)
    return st.floats(allow_nan=False, width=32 if field.base == "float32" else 64)


def values(field: Field) -> st.SearchStrategy[Any]:
    if not field.many:
        return scalars(field)
    low, high = (field.size, field.size) if field.many == "array" else (0, min(field.size or 3, 3))
    if field.message or field.base in STRINGS:
        return st.lists(scalars(field), min_size=low, max_size=high)
    elements = None if field.base in INTEGERS or field.base == "bool" else {"allow_nan": False}
    shape = st.integers(low, high)
    return hnp.arrays(types.dtype_of(field.base), shape, elements=elements)


def messages(name: str) -> st.SearchStrategy[Any]:
    fields = fields_of(name)
    made = st.fixed_dictionaries(
        {field.attribute: st.deferred(lambda f=field: values(f)) for field in fields}
    )
    return made.map(lambda given: types.get(name)(**given))


def same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b)
    if isinstance(a, list):
        return len(a) == len(b) and all(map(same, a, b))
    if hasattr(a, "__msgtype__"):
        names = [field.attribute for field in fields_of(a.__msgtype__)]
        return type(a) is type(b) and all(same(getattr(a, n), getattr(b, n)) for n in names)
    return type(a) is type(b) and a == b


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_every_type_survives_the_way_there_and_back(data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(NAMES))
    cls = types.get(name)
    message = data.draw(messages(name))
    payload = codec(cls).encode(message)
    assert same(codec(cls).decode(payload), message)
    assert same(codec(cls).decode(payload + b"\0" * (-len(payload) % 4)), message)


SIZES = {"float32": 4, "float64": 8, "bool": 1, "byte": 1, "char": 1}


def plain_cdr(message: Any, out: bytearray, padding: bytes = b"\0") -> None:
    """Write CDR as its standard says, without any cleverness; `out` begins after the encapsulation."""
    fields = fields_of(message.__msgtype__)
    for field in fields:
        value = getattr(message, field.attribute)
        if field.many in ("bounded", "sequence"):
            number(out, "I", 4, len(value), padding)
        for item in value if field.many else [value]:
            if field.message:
                plain_cdr(item, out, padding)
            elif field.base == "string":
                raw = item.encode() + b"\0"
                number(out, "I", 4, len(raw), padding)
                out += raw
            elif field.base == "wstring":
                units = struct.unpack(f"<{len(item.encode('utf-16-le')) // 2}H", item.encode("utf-16-le"))
                number(out, "I", 4, len(units), padding)
                for unit in units:
                    number(out, "I", 4, unit, padding)
            else:
                size = SIZES.get(field.base) or int(field.base.strip("uint")) // 8
                number(out, CODES[field.base], size, item, padding)
    if not fields:
        out += b"\0"


CODES = {"bool": "?", "byte": "b", "char": "B", "float32": "f", "float64": "d"} | {
    f"{sign}int{bits}": code.upper() if sign else code
    for bits, code in ((8, "b"), (16, "h"), (32, "i"), (64, "q"))
    for sign in ("", "u")
}


def number(out: bytearray, code: str, size: int, value: Any, padding: bytes = b"\0") -> None:
    out += padding * (-len(out) % size)
    out += struct.pack("<" + code, value & 255 if code == "B" else value)


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_bytes_are_those_of_the_standard(data: st.DataObject) -> None:
    message = data.draw(messages(data.draw(st.sampled_from(NAMES))))
    wanted = bytearray()
    plain_cdr(message, wanted)
    assert codec(type(message)).encode(message) == b"\0\1\0\0" + wanted


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_nonsense_is_refused_or_read_but_never_hangs(data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(NAMES))
    cls = types.get(name)
    head = data.draw(st.sampled_from([b"\0\1\0\0", b"\0\0\0\0", b"\0\7\0\0", b""]))
    payload = head + data.draw(st.binary(max_size=400))
    try:
        message = codec(cls).decode(payload)
    except Exception:  # which one is not specified
        return
    assert type(message) is cls
    if payload[:2] != b"\0\0":
        assert payload[:2] == b"\0\1"


HUGE = [2**32 - 1, 2**31, 2**28]


@pytest.mark.parametrize(
    "cls", [TFMessage, PoseArray, JointState, LaserScan, PointCloud2, String, Float64MultiArray]
)
@pytest.mark.parametrize("at", range(4, 64, 4))
def test_a_huge_length_takes_no_memory(cls: type[Any], at: int) -> None:
    one = codec(cls)
    payload = bytearray(one.encode(new(cls)) + bytes(64))
    tracemalloc.start()
    try:
        for length in HUGE:
            payload[at : at + 4] = struct.pack("<I", length)
            decode_anyhow(one, bytes(payload))
        assert tracemalloc.get_traced_memory()[1] < 2_000_000
    finally:
        tracemalloc.stop()


def decode_anyhow(one: Codec[Any], payload: bytes) -> None:
    with contextlib.suppress(Exception):  # which one is not specified
        one.decode(payload)


@pytest.mark.parametrize("cls", [Imu, JointState, LaserScan, PoseArray, String, TFMessage, Twist])
def test_bytes_after_the_message_are_told(cls: type[Any]) -> None:
    payload = codec(cls).encode(new(cls))
    message, end = codec(cls).read(payload + bytes(88))
    assert same(message, new(cls))
    assert end == len(payload)


@pytest.mark.parametrize(
    ("message", "said"),
    [
        (
            new(types.get("std_msgs/msg/Int8"), data=300),
            "std_msgs/msg/Int8 .*data is a int8 and cannot be 300",
        ),
        (new(types.get("std_msgs/msg/Int8"), data=None), "data is a int8 and cannot be None"),
        (new(String, data=5), "data is a string and cannot be 5; valid: a text"),
        (new(String, data="\ud800"), "surrogate"),
        (new(Twist, linear=None), "linear is a geometry_msgs/msg/Vector3 and cannot be None"),
        (new(Twist, linear=new(Pose)), "linear"),
        (
            new(Imu, linear_acceleration_covariance=np.zeros(8)),
            "linear_acceleration_covariance has 8 elements",
        ),
        (new(PoseArray, poses=[new(Pose), 3]), r"poses\[1\]"),
        (new(TFMessage, transforms=[None]), r"transforms\[0\]"),
        (new(LaserScan, ranges=np.array([1e300])), r"ranges\[0\]"),
        (new(types.get("test_msgs/msg/WStrings"), array_of_wstrings=["a"]), "1 elements; valid: exactly 3"),
    ],
)
def test_a_value_that_does_not_fit_is_named(message: Any, said: str) -> None:
    with pytest.raises(BridgeError, match=said):
        codec(type(message)).encode(message)


def test_lists_and_other_numbers_are_sent_as_what_the_field_is() -> None:
    point = new(JointTrajectoryPoint, positions=[1, 2.5])  # type: ignore[arg-type]  # as rclpy allows
    one = codec(JointTrajectoryPoint)
    assert one.decode(one.encode(point)).positions.tolist() == [1.0, 2.5]
    array = new(Float64MultiArray, data=np.array([1, 2, 3]))
    assert codec(Float64MultiArray).decode(codec(Float64MultiArray).encode(array)).data.tolist() == [1, 2, 3]
    scan = new(LaserScan, ranges=np.arange(10.0)[::2])
    assert codec(LaserScan).decode(codec(LaserScan).encode(scan)).ranges.tolist() == [0, 2, 4, 6, 8]
    status = new(DiagnosticStatus, level=200)
    assert codec(DiagnosticStatus).decode(codec(DiagnosticStatus).encode(status)).level & 255 == 200


def test_a_wstring_is_utf_16_in_words_of_four_bytes() -> None:
    # rosidl_typesupport_fastrtps_cpp: the number of units, and each as an uint32
    wide = types.get("example_interfaces/msg/WString")
    payload = codec(wide).encode(wide("aé😀"))
    assert payload == b"\0\1\0\0" + struct.pack("<5I", 4, ord("a"), 0xE9, 0xD83D, 0xDE00)
    with pytest.raises(Exception, match="UTF-16"):
        codec(wide).decode(b"\0\1\0\0" + struct.pack("<2I", 1, 0x10000))
