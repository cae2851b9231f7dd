from __future__ import annotations

import numpy as np
import pytest

from twin.bridge import types
from twin.bridge.messages.as_text import message_repr
from twin.bridge.messages.from_values import message_from_dict
from twin.bridge.types.default_values import new


@pytest.mark.parametrize(
    ("typename", "values", "text"),
    [
        ("std_srvs/srv/Empty_Response", {}, "std_srvs.srv.Empty_Response()"),
        (
            "example_interfaces/srv/AddTwoInts_Request",
            {"a": 2},
            "example_interfaces.srv.AddTwoInts_Request(a=2, b=0)",
        ),
        (
            "std_msgs/msg/Header",
            {"frame_id": "it's"},
            'std_msgs.msg.Header(stamp=builtin_interfaces.msg.Time(sec=0, nanosec=0), frame_id="it\'s")',
        ),
        (
            "example_interfaces/action/Fibonacci_Result",
            {"sequence": [0, 1, 1]},
            "example_interfaces.action.Fibonacci_Result(sequence=[0, 1, 1])",
        ),
        (
            "example_interfaces/action/Fibonacci_Result",
            {},
            "example_interfaces.action.Fibonacci_Result(sequence=[])",
        ),
        ("std_msgs/msg/Float32", {"data": 0.5}, "std_msgs.msg.Float32(data=0.5)"),
        ("std_msgs/msg/Byte", {"data": 7}, "std_msgs.msg.Byte(data=b'\\x07')"),
    ],
)
def test_a_message_on_one_line_is_spelled_as_by_rclpy(typename: str, values: object, text: str) -> None:
    assert message_repr(message_from_dict(types.get(typename), values)) == text  # type: ignore[arg-type]


def test_sequences_and_arrays_of_rclpy() -> None:
    joints = new(types.get("sensor_msgs/msg/JointState"), name=["a"], position=np.array([0.1], np.float64))
    assert "name=['a'], position=[0.1], velocity=[]" in message_repr(joints)
    uuid = new(types.get("unique_identifier_msgs/msg/UUID"))
    assert message_repr(uuid).startswith("unique_identifier_msgs.msg.UUID(uuid=array([0, 0, 0")
    assert message_repr(uuid).endswith("dtype=uint8))")
