"""Run by a python that has real rclpy: messages serialised by it, as [type, values, hex].

Arguments: a seed, messages per type. Standard input begins with a line of types, a JSON list. For each
message a line is printed, and one is read: its hex as others serialise it, to be compared here.
Without arguments: what is in tests/bridge/data/rclpy_messages.json.
"""

from __future__ import annotations

import json
import random
import re
import struct
import sys
from importlib import import_module, metadata
from typing import Any

from rclpy.serialization import deserialize_message, serialize_message

PARTS = {
    "_Request": "Request",
    "_Response": "Response",
    "_Event": "Event",
    "_SendGoal_Request": "Impl.SendGoalService.Request",
    "_SendGoal_Response": "Impl.SendGoalService.Response",
    "_GetResult_Request": "Impl.GetResultService.Request",
    "_GetResult_Response": "Impl.GetResultService.Response",
    "_FeedbackMessage": "Impl.FeedbackMessage",
    "_Goal": "Goal",
    "_Result": "Result",
    "_Feedback": "Feedback",
}
"""What a part of a service or action is called in rclpy; the longest ending counts."""
PADDING = "structure_needs_at_least_one_member"
LETTERS = "abcXYZ_/ 0189éß中文"
WIDE_LETTERS = LETTERS + "😀"
SIZES = {f"{sign}int{bits}": (sign == "u", bits) for sign in ("", "u") for bits in (8, 16, 32, 64)}


def class_of(name: str) -> Any:
    """Return rclpy's class; raises ImportError or AttributeError if it is not there."""
    package, kind, tail = name.split("/")
    module = import_module(f"{package}.{kind}")
    if kind == "msg":
        return getattr(module, tail)
    ending = max((end for end in PARTS if tail.endswith(end)), key=len)
    found = getattr(module, tail.removesuffix(ending))
    for part in PARTS[ending].split("."):
        found = getattr(found, part)
    return found


def message(chance: random.Random, cls: Any, depth: int = 0) -> tuple[Any, dict[str, Any]]:
    """Return a message, and its values as JSON has them."""
    made, told = cls(), {}
    for name, kind in cls.get_fields_and_field_types().items():
        if name == PADDING:
            continue
        value, told[name] = field(chance, kind, depth)
        setattr(made, name, value)
    return made, told


def field(chance: random.Random, kind: str, depth: int) -> tuple[Any, Any]:
    array = re.fullmatch(r"(.+)\[(\d+)\]", kind)
    sequence = re.fullmatch(r"sequence<(.+?)(?:, (\d+))?>", kind)
    if not array and not sequence:
        return scalar(chance, kind, depth)
    most = min(int(sequence[2] or 3), 3 if depth < 3 else 1) if sequence else 0
    count = int(array[2]) if array else chance.choice((0, 0, *range(most + 1)))
    inner = (array or sequence)[1]  # type: ignore[index]
    pairs = [scalar(chance, inner, depth) for _ in range(count)]
    values = [value for value, _ in pairs]
    return values, [told for _, told in pairs]


def scalar(chance: random.Random, kind: str, depth: int) -> tuple[Any, Any]:
    if "/" in kind:
        package, name = kind.split("/")
        return message(chance, nested(package, name), depth + 1)
    text = re.fullmatch(r"(w?string)(?:<(\d+)>)?", kind)
    if text:
        letters = WIDE_LETTERS if text[1] == "wstring" else LETTERS
        # A bound counts bytes.
        most = min(9, int(text[2] or 36) // 4)
        value = "".join(chance.choices(letters, k=chance.choice((0, *range(most + 1)))))
        return value, value
    if kind == "boolean":
        flag = chance.random() < 0.5
        return flag, flag
    if kind == "octet":
        byte = chance.randrange(256)
        return bytes([byte]), byte
    if kind in SIZES:
        unsigned, bits = SIZES[kind]
        low, high = (0, 2**bits - 1) if unsigned else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        number = chance.choice((low, high, 0, 1, chance.randint(low, high)))
        return number, number
    if kind in ("float", "double"):
        real = chance.choice((0.0, -0.0, float("inf"), -1.5, chance.gauss(0.0, 10.0) ** 7))
        if kind == "float":
            (real,) = struct.unpack("<f", struct.pack("<f", real))
        return real, real
    raise TypeError(kind)


def nested(package: str, name: str) -> Any:
    """Return a field's class; actions have fields of their own parts."""
    for kind in ("msg", "srv", "action"):
        try:
            return class_of(f"{package}/{kind}/{name}")
        except (ImportError, AttributeError, ValueError):
            continue
    raise TypeError(f"{package}/{name}")


def compare(seed: str, count: str) -> None:
    for name in json.loads(sys.stdin.readline()):
        try:
            cls = class_of(name)
        except (ImportError, AttributeError):
            continue
        chance = random.Random(f"{seed} {name}")
        for _ in range(int(count)):
            made, told = message(chance, cls)
            say([name, told, serialize_message(made).hex()])
            answer = bytes.fromhex(sys.stdin.readline())
            assert deserialize_message(answer, cls) == made, (name, told, answer.hex())


GOLDEN = (
    "builtin_interfaces/msg/Time",
    "diagnostic_msgs/msg/DiagnosticStatus",
    "geometry_msgs/msg/PoseArray",
    "geometry_msgs/msg/Twist",
    "nav_msgs/msg/Odometry",
    "nav_msgs/msg/Path",
    "rcl_interfaces/msg/ParameterEvent",
    "rcl_interfaces/msg/ParameterValue",
    "rcl_interfaces/srv/GetParameters_Response",
    "rcl_interfaces/srv/SetParameters_Request",
    "rosgraph_msgs/msg/Clock",
    "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/JointState",
    "sensor_msgs/msg/LaserScan",
    "std_msgs/msg/Float64MultiArray",
    "std_srvs/srv/Empty_Request",
    "std_srvs/srv/Trigger_Response",
    "test_msgs/action/Fibonacci_FeedbackMessage",
    "test_msgs/action/Fibonacci_SendGoal_Request",
    "test_msgs/msg/UnboundedSequences",
    "test_msgs/msg/WStrings",
    "test_msgs/srv/Arrays_Response",
    "trajectory_msgs/msg/JointTrajectory",
    "trajectory_msgs/msg/JointTrajectoryPoint",
)


def golden() -> None:
    """Print each type empty and filled at random."""
    lines = []
    for name in GOLDEN:
        cls, chance = class_of(name), random.Random(name)
        empty, told = message(Least(), cls)
        pairs = [(empty, told), message(chance, cls), message(chance, cls)]
        lines += [json.dumps([name, told, serialize_message(made).hex()]) for made, told in pairs]
    versions = {name: metadata.version(name) for name in ("ros-rclpy", "ros-rmw-fastrtps-cpp")}
    head = {"made by": "tests/bridge/cdr/rclpy_peer.py", "serialized by": versions}
    text = json.dumps(head)[:-1]
    sys.stdout.write(f'{text},\n"messages": [\n' + ",\n".join(lines) + "\n]}\n")


class Least(random.Random):
    """Chooses the first, and the least: sequences and strings are empty."""

    def choice(self, seq: Any) -> Any:
        return seq[0]

    def random(self) -> float:
        return 0.0

    def getrandbits(self, k: int) -> int:
        return 0


def say(what: Any) -> None:
    sys.stdout.write(json.dumps(what) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    if len(sys.argv) == 3:
        compare(*sys.argv[1:])
    else:
        golden()
