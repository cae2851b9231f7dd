"""Messages that real rclpy serialised, in buffers of an estimated size, padded with any memory."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.bridge.cdr.test_all_types import NAMES, messages, plain_cdr, same
from twin.bridge import types
from twin.bridge.cdr.codec import codec
from twin.bridge.types.fields import fields_of

GOLDEN: list[tuple[str, dict[str, Any], str]] = json.loads(
    (Path(__file__).parents[1] / "data" / "rclpy_messages.json").read_text("utf-8")
)["messages"]
PYTHON = os.environ.get("TWIN_RCLPY_ORACLE", "")
SEEDS = os.environ.get("TWIN_RCLPY_SEEDS", "1 2 3").split()
PER_TYPE = 10
HIDDEN = (
    "SendGoal_Request",
    "SendGoal_Response",
    "GetResult_Request",
    "GetResult_Response",
    "FeedbackMessage",
)
ALL = [
    *NAMES,
    *(f"{name}_Event" for name in types.names() if "/srv/" in name),
    *(f"{name}_{part}" for name in types.names() if "/action/" in name for part in HIDDEN),
]


def values_of(message: Any) -> Any:
    """Return a message as JSON has it; bytes without a sign."""
    if isinstance(message, np.ndarray):
        return message.tolist()
    if isinstance(message, list):
        return [values_of(item) for item in message]
    if not hasattr(message, "__msgtype__"):
        return message
    found = {}
    for field in fields_of(message.__msgtype__):
        value = values_of(getattr(message, field.attribute))
        if field.base == "byte":
            value = [item & 255 for item in value] if field.many else value & 255
        found[field.name] = value
    return found


def read_like_ros(name: str, values: dict[str, Any], payload: bytes) -> tuple[Any, int]:
    """Read a message both ways; what is encoded again is exact. Return it and how many bytes follow it."""
    one = codec(types.get(name))
    message, end = one.read(payload)
    assert values_of(message) == values, name
    assert end <= len(payload)
    exact = one.encode(message)
    assert len(exact) == end
    assert same(one.decode(exact), message)
    return message, len(payload) - end


@pytest.mark.parametrize("name", sorted({name for name, _, _ in GOLDEN}))
def test_what_rclpy_serialises_is_read(name: str) -> None:
    mine = [(values, bytes.fromhex(payload)) for kind, values, payload in GOLDEN if kind == name]
    after = [read_like_ros(name, values, payload)[1] for values, payload in mine]
    of_empty = {"JointState": 8, "ParameterValue": 8, "JointTrajectoryPoint": 16, "Float64MultiArray": 4}
    assert after[0] == of_empty.get(name.rsplit("/")[-1], after[0])


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_padding_and_what_follows_may_be_anything(data: st.DataObject) -> None:
    message = data.draw(messages(data.draw(st.sampled_from(NAMES))))
    body = bytearray()
    plain_cdr(message, body, padding=b"\xa5")
    payload, cls = b"\0\1\0\0" + bytes(body), type(message)
    read, end = codec(cls).read(payload + b"\xa5" * 88)
    assert same(read, message)
    assert end == len(payload)


@pytest.mark.skipif(not Path(PYTHON or "-").exists(), reason="TWIN_RCLPY_ORACLE names no python; make oracle")
@pytest.mark.parametrize("seed", SEEDS)
def test_random_messages_of_every_type_both_ways(seed: str) -> None:
    peer = subprocess.Popen(
        [PYTHON, str(Path(__file__).with_name("rclpy_peer.py")), seed, str(PER_TYPE)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={key: value for key, value in os.environ.items() if not key.startswith("PYTHON")},
    )
    assert peer.stdin is not None
    assert peer.stdout is not None
    with peer:
        print(json.dumps(ALL), file=peer.stdin, flush=True)
        count, trailing, kinds = 0, 0, set()
        for line in peer.stdout:
            name, values, payload = json.loads(line)
            message, left = read_like_ros(name, values, bytes.fromhex(payload))
            print(codec(types.get(name)).encode(message).hex(), file=peer.stdin, flush=True)
            count, trailing, kinds = count + 1, trailing + (left >= 4), kinds | {name}
        assert peer.wait() == 0
    assert len(kinds) > 200
    assert count == len(kinds) * PER_TYPE
    assert trailing > count / 50
