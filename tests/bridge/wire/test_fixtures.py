"""What others put on the wire, byte by byte; tests/bridge/data/wire_fixtures.json names every source."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from twin.bridge import types
from twin.bridge.cdr.codec import codec
from twin.bridge.graph import EndpointInfo, parse_token, parse_tokens
from twin.bridge.msgs import String
from twin.bridge.qos import (
    INFINITE_NS,
    SYSTEM_DEFAULT,
    QoS,
    parse_qos,
    profile,
    qos_string,
)
from twin.bridge.wire import ros2dds as wire_ros2dds
from twin.bridge.wire.keys import Attachment, NodeToken, gid, pack_attachment, parse_attachment, topic_key
from twin.bridge.wire.naming import Interface, mismatch, parse_key

FIXTURES: dict[str, list[dict[str, Any]]] = json.loads(
    (Path(__file__).parents[1] / "data" / "wire_fixtures.json").read_text("utf-8")
)


def cases(kind: str) -> Any:
    return pytest.mark.parametrize("case", FIXTURES[kind])


def test_every_fixture_names_its_source() -> None:
    groups = [group for name, group in FIXTURES.items() if name != "sources"]
    assert {case["source"] for group in groups for case in group} == set(FIXTURES["sources"])


@cases("keys")
def test_keys(case: dict[str, Any]) -> None:
    dds_name, type_hash = types.dds_name(case["type"]), types.rihs01(case["type"])
    assert topic_key(case["domain"], case["name"], dds_name, type_hash) == case["key"]
    assert parse_key(case["key"]) == (str(case["domain"]), (case["name"], dds_name, type_hash))


@cases("node_tokens")
def test_node_tokens(case: dict[str, Any]) -> None:
    token = NodeToken(case["domain"], case["session"], 0, case["namespace"], case["node"])
    assert str(token) == case["token"]


@cases("endpoint_tokens")
def test_endpoint_tokens_and_gids(case: dict[str, Any]) -> None:
    node = NodeToken(0, case["session"], 0, "/", case["node"])
    dds_name, type_hash = types.dds_name(case["type"]), types.rihs01(case["type"])
    qos = QoS(**case["qos"])
    token = node.endpoint(case["id"], case["kind"], case["name"], dds_name, type_hash, qos)
    assert token == case["token"]
    if "gid" in case:
        assert gid(token).hex() == case["gid"]  # what the live publisher sent along with its samples
    info = parse_token(token)
    assert isinstance(info, EndpointInfo)
    assert (info.kind, info.name, info.type, info.qos) == (case["kind"], case["name"], case["type"], qos)


def test_a_token_of_lyrical_has_more_fields() -> None:
    token = FIXTURES["endpoint_tokens"][0]["token"]
    info = parse_token(f"{token}/cpu:/another")
    assert isinstance(info, EndpointInfo)
    assert info.type == "std_msgs/msg/String"


@cases("attachments")
def test_attachments(case: dict[str, Any]) -> None:
    data, source = bytes.fromhex(case["bytes"]), bytes.fromhex(case["gid"])
    assert parse_attachment(data) == (case["sequence"], case["time_ns"], source)
    assert pack_attachment(case["sequence"], case["time_ns"], source) == data


@cases("payloads")
def test_payloads(case: dict[str, Any]) -> None:
    assert codec(String).encode(String(case["data"])) == bytes.fromhex(case["bytes"])


@cases("qos")
def test_qos(case: dict[str, Any]) -> None:
    qos = QoS(**case["qos"])
    assert qos_string(qos) == case["text"]
    assert parse_qos(case["text"]) == qos


@pytest.mark.parametrize(
    "text",
    [
        "",
        "::",
        "::,10:,:,:,",
        "x::,10:,:,:,,",
        "::,-1:,:,:,,",
        "::,1e9:,:,:,,",
        "::,10:a,:,:,,",
        ":9:,:,:,:,,",
    ],
)
def test_qos_that_rmw_zenoh_would_not_read(text: str) -> None:
    with pytest.raises(ValueError, match=r"rmw_zenoh|policy|number"):
        parse_qos(text)


def test_words_of_rmw_and_their_defaults() -> None:
    assert profile() == SYSTEM_DEFAULT == QoS(depth=42)
    assert profile(reliability="best_available", depth=3, deadline_ns=0).deadline_ns == INFINITE_NS
    assert profile(history="keep_all", liveliness="manual_by_topic").history == "keep_all"
    with pytest.raises(
        ValueError, match="'fast' is no QoS policy; valid: reliable, best_effort, system_default"
    ):
        profile(reliability="fast")
    assert parse_qos("0:0:0,:0,0:0,0:0,0,0") == SYSTEM_DEFAULT


@cases("ros2dds_tokens")
def test_tokens_of_the_bridge(case: dict[str, Any]) -> None:
    item = (case["name"], types.dds_name(case["type"]), types.rihs01(case["type"]))
    qos = QoS(**case["qos"])
    assert wire_ros2dds.endpoint_token("ab", case["kind"], *item, qos) == case["token"]
    (info,) = parse_tokens(case["token"])
    assert isinstance(info, EndpointInfo)
    assert (info.kind, info.name, info.type) == (case["kind"], case["name"], case["type"])
    assert info.node.full_name == "/zenoh_bridge_ros2dds"
    assert info.qos == qos


@cases("ros2dds_qos")
def test_qos_of_the_bridge(case: dict[str, Any]) -> None:
    announced = wire_ros2dds.parse_token(f"@/ab/@ros2_lv/MS/chatter/std_msgs§msg§String/{case['text']}")
    assert announced is not None
    qos = announced.qos
    assert (qos.reliability, qos.durability) == (case["reliability"], case["durability"])
    assert qos.depth == case.get("depth", 42)


@cases("request_ids")
def test_request_ids_of_the_bridge(case: dict[str, Any]) -> None:
    source = wire_ros2dds.parse_request_id(bytes.fromhex(case["bytes"]))
    assert source == Attachment(case["sequence"], 0, bytes.fromhex(case["client"]) + bytes(8))
    if case["bytes"].endswith("01"):
        assert wire_ros2dds.pack_request_id(source).hex() == case["bytes"]


def test_what_does_not_match_says_why() -> None:
    item = Interface("/x", "std_msgs::msg::dds_::String_", "RIHS01_1")
    assert mismatch(item, "0/x/std_msgs::msg::dds_::String_/RIHS01_1") is None
    assert mismatch(item, "0/x/std_msgs::msg::dds_::String_/TypeHashNotSupported") is None
    assert mismatch(item, "x") is None
    assert mismatch(item, "0/x/std_msgs::msg::dds_::String_/RIHS01_2") == (
        "type hash",
        "RIHS01_2 instead of RIHS01_1",
    )
    reason, detail = mismatch(item, f"0/x/{'y' * 10_000}::dds_::z/RIHS01_1") or ("", "")
    assert (reason, len(detail) < 200) == ("type", True)
