from __future__ import annotations

import struct

import pytest
import zenoh

from twin.bridge import types
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import Twist, new
from twin.bridge.qos import LATCHED, SENSOR_DATA, QoS, qos_string
from twin.bridge.srvs import Trigger
from twin.bridge.wire.keys import (
    EndpointKind,
    NodeToken,
    gid,
    pack_attachment,
    parse_attachment,
    topic_key,
)
from twin.bridge.wire.session import direct

TWIST = "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"
TRIGGER = "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f"


def test_topic_key() -> None:
    assert (
        topic_key(0, "/robot/cmd_vel", types.dds_name("geometry_msgs/msg/Twist"), TWIST)
        == f"0/robot/cmd_vel/geometry_msgs::msg::dds_::Twist_/{TWIST}"
    )


@pytest.mark.parametrize(
    ("qos", "text"),
    [
        (QoS(depth=10), "::,10:,:,:,,"),
        (SENSOR_DATA, "2::,5:,:,:,,"),
        (LATCHED, ":1:,1:,:,:,,"),
        (QoS(depth=42), "::,:,:,:,,"),
    ],
)
def test_qos_as_rmw_zenoh_spells_it(qos: QoS, text: str) -> None:
    assert qos_string(qos) == text


# The examples in rmw_zenoh's docs/design.md.
STRING = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
ADD = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
EXAMPLES = [
    (
        ("aac3178e146ba6f1fc6e6a4085e77f21", "listener", "MS", "/chatter", "std_msgs/msg/String", 10),
        f"%chatter/std_msgs::msg::dds_::String_/{STRING}/::,10:,:,:,,",
    ),
    (
        ("8b20917502ee955ac4476e0266340d5c", "talker", "MP", "/chatter", "std_msgs/msg/String", 7),
        f"%chatter/std_msgs::msg::dds_::String_/{STRING}/::,7:,:,:,,",
    ),
    (
        (
            "f9980ee0495eaafb3e38f0d19e2eae12",
            "srv",
            "SS",
            "/add_two_ints",
            "example_interfaces/srv/AddTwoInts",
            10,
        ),
        f"%add_two_ints/example_interfaces::srv::dds_::AddTwoInts_/{ADD}/::,10:,:,:,,",
    ),
]


@pytest.mark.parametrize(("endpoint", "tail"), EXAMPLES)
def test_endpoint_tokens(endpoint: tuple[str, str, EndpointKind, str, str, int], tail: str) -> None:
    session, node, kind, name, typename, depth = endpoint
    token = NodeToken(2, session, 0, "/", node).endpoint(
        10, kind, name, types.dds_name(typename), types.rihs01(typename), QoS(depth=depth)
    )
    assert token == f"@ros2_lv/2/{session}/0/10/{kind}/%/%/{node}/{tail}"


def test_node_tokens() -> None:
    listener = NodeToken(2, "aac3178e146ba6f1fc6e6a4085e77f21", 0, "/", "listener")
    assert str(listener) == "@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/listener"
    assert str(NodeToken(0, "a", 3, "/robot/left", "n")) == "@ros2_lv/0/a/3/3/NN/%/%robot%left/n"


def test_attachment_is_33_bytes() -> None:
    data = pack_attachment(7, 123, bytes(range(16)))
    assert data == struct.pack("<qqB", 7, 123, 16) + bytes(range(16))
    assert parse_attachment(data) == (7, 123, bytes(range(16)))
    assert parse_attachment(data[:-1]) is None
    assert parse_attachment(data[:16] + b"\x0f" + data[17:]) is None
    assert parse_attachment(None) is None


def test_gid_is_xxh3_low_half_first() -> None:
    # XXH3-128 of the empty input is 99aa06d3014798d8 6001c324468d497f (xxHash's specification).
    assert gid("").hex() == "7f498d4624c30160d8984701d306aa99"


def test_what_a_node_puts_on_the_wire() -> None:
    with Bus.open(Clock(now_ns=5), domain_id=7) as bus:
        _check_wire(bus)


def _check_wire(bus: Bus) -> None:
    samples: list[zenoh.Sample] = []
    bus.session.declare_subscriber("7/**", direct(samples.append))
    node = bus.create_node("driver", "robot")
    publisher = node.create_publisher(Twist, "cmd_vel")
    node.create_service(Trigger, "~/reset", lambda request: Trigger.Response(True, ""))
    publisher.publish(new(Twist))
    owner, names = f"@ros2_lv/7/{bus.session_id}/0", "%/%robot/driver"
    twist = f"geometry_msgs::msg::dds_::Twist_/{TWIST}"
    token = f"{owner}/1/MP/{names}/%robot%cmd_vel/{twist}/::,10:,:,:,,"
    assert _alive(bus) == [
        f"{owner}/0/NN/{names}",
        token,
        f"{owner}/2/SS/{names}/%robot%driver%reset/std_srvs::srv::dds_::Trigger_/{TRIGGER}/::,10:,:,:,,",
    ]
    (sample,) = samples
    assert str(sample.key_expr) == f"7/robot/cmd_vel/{twist}"
    assert sample.payload.to_bytes() == bytes.fromhex("00010000") + bytes(48)
    assert sample.attachment is not None
    assert sample.attachment.to_bytes() == struct.pack("<qqB", 1, 5, 16) + gid(token)
    node.destroy()
    assert _alive(bus) == []


def _alive(bus: Bus) -> list[str]:
    tokens: list[str] = []
    handler = direct(lambda reply: tokens.append(str(reply.ok.key_expr)))
    bus.session.liveliness().get("@ros2_lv/**", handler)
    return sorted(tokens)
