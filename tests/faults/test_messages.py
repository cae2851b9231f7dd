"""A network that loses, delays or doubles messages."""

from __future__ import annotations

import re

import pytest

from tests.faults.conftest import Drive
from twin.bridge.msgs import Imu, LaserScan, Odometry
from twin.errors import ScenarioError

IMU = ((Imu, "/imu"),)


def test_lost_messages_reach_neither_nodes_nor_taps(drive: Drive) -> None:
    plain = drive("", listen=IMU)
    lossy = drive("[loss: {share: 30 %, topic: /imu}]", listen=IMU)
    said = [told.time_ns for told in lossy.said["/imu"]]
    assert len(lossy.heard["/imu"]) in (len(said), len(said) - 1), "the last one waits for the next tick"
    assert set(said) < {told.time_ns for told in plain.said["/imu"]}
    report = lossy.reports["loss"]
    assert report.outcome == "landed"
    assert report.effect == f"{75 - len(said)} of 75 messages lost"
    assert 8 <= 75 - len(said) <= 37
    assert [repr(told) for told in plain.said["/scan"]] == [repr(told) for told in lossy.said["/scan"]]


def test_without_a_topic_only_what_crosses_a_network_unprotected_gets_lost(drive: Drive) -> None:
    plain, mute = drive(), drive("[loss: 1]")
    left = {topic for topic, told in mute.said.items() if told}
    assert {"/clock", "/rosout", "/tf_static", "/robot_description"} <= left
    assert not {"/imu", "/scan", "/odom", "/tf", "/cmd_vel", "/joint_states"} & left
    for topic in ("/clock", "/mission/state"):
        assert list(map(repr, mute.said[topic])) == list(map(repr, plain.said[topic])), (
            "latched, or of the run"
        )
    assert mute.pose.distance(plain.pose) > 0.2, "no command came"


def test_a_pattern_means_some_topics(drive: Drive) -> None:
    ended = drive("[loss: {share: 1, topic: '/[i-s]*'}]")
    assert "/imu" not in ended.said
    assert "/scan" not in ended.said
    assert "/tf" in ended.said
    assert "/rosout" in ended.said


def test_late_messages_come_once_and_in_order_with_their_own_stamps(drive: Drive) -> None:
    listen = ((Odometry, "/odom"),)
    plain, late = drive("", listen=listen), drive("[link_delay: {time: 90 ms, topic: odom}]", listen=listen)
    ages = {told.age_ns for told in late.said["/odom"]}
    assert ages == {100_000_000}, "at the next control period"
    missing = len(plain.heard["/odom"]) - len(late.heard["/odom"])
    assert missing == 5
    assert list(map(repr, late.heard["/odom"])) == list(map(repr, plain.heard["/odom"][:-missing]))
    assert late.reports["link_delay"].effect == "74 of 74 messages late"


def test_with_jitter_messages_pass_each_other(drive: Drive) -> None:
    ended = drive("[link_delay: {time: 100 ms, jitter: 50 ms, topic: /imu}]", listen=IMU)
    stamps = [told.time_ns - told.age_ns for told in ended.said["/imu"]]
    assert stamps != sorted(stamps)
    assert len(set(stamps)) == len(stamps)
    ages = [told.age_ns / 1e6 for told in ended.said["/imu"]]
    assert 80 < sum(ages) / len(ages) < 140
    assert min(ages) >= 0


def test_doubled_messages_come_twice(drive: Drive) -> None:
    plain = drive("", listen=IMU)
    double = drive("[duplication: {share: 1, time: 30 ms, topic: /imu}]", listen=IMU)
    stamps = [told.time_ns - told.age_ns for told in double.said["/imu"]]
    first = [told.time_ns for told in plain.said["/imu"]]
    assert [stamps.count(stamp) for stamp in first[:-3]] == [2] * (len(first) - 3)
    assert sorted({told.age_ns for told in double.said["/imu"]}) == [0, 40_000_000]
    some = drive("[duplication: {share: 30 %, topic: /imu}]", listen=IMU)
    assert 80 <= len(some.said["/imu"]) <= 112


def test_faults_of_a_link_add_up_and_end(drive: Drive) -> None:
    faults = (
        "[{loss: {share: 1, topic: /scan, at: 0.25 s, duration: 0.3 s}},"
        " {link_delay: {time: 100 ms, topic: /scan}}, {link_delay: {time: 60 ms, topic: /scan, label: more}}]"
    )
    ended = drive(faults, listen=((LaserScan, "/scan"),))
    ages = {told.age_ns for told in ended.said["/scan"]}
    assert ages == {160_000_000}
    stamps = [round((told.time_ns - told.age_ns) / 1e8) for told in ended.said["/scan"]]
    assert stamps == [1, 2, 6, 7, 8, 9, 10, 11, 12, 13]


def test_what_nobody_hears_has_no_effect(drive: Drive) -> None:
    report = drive("[loss: {share: 1, topic: /imu}]").reports["loss"]
    assert (report.outcome, report.effect) == ("no_effect", "nobody hears these 75 messages")


def test_a_late_message_is_as_it_was_when_it_was_said(drive: Drive) -> None:
    """Whatever its publisher does with its object meanwhile; recordings look at it when it arrives."""
    plain, late = drive(), drive("[link_delay: {time: 60 ms, topic: /cmd_vel}]")
    was = [told.message.linear.x for told in plain.said["/cmd_vel"]]
    now = [told.message.linear.x for told in late.said["/cmd_vel"]]
    assert now == was[: len(now)]
    assert late.pose.distance(plain.pose) < 0.1


def test_a_topic_that_is_not_there_is_told(drive: Drive) -> None:
    with pytest.raises(ScenarioError, match=re.escape("there is no topic '/imo'; did you mean '/imu'")):
        drive("[loss: {share: 1, topic: imo}]")
    with pytest.raises(ScenarioError, match="there is no topic '/camera/\\*'"):
        drive("[loss: {share: 1, topic: '/camera/*'}]")
