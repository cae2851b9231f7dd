"""Short hashes per topic and second: two runs can be compared from them alone."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any

import pytest

from twin.recording.digest import RunDigest
from twin.recording.hashes import RunHashes

SECOND = 1_000_000_000


def sample(topic: str, time_ns: int, payload: bytes) -> Any:
    return SimpleNamespace(
        topic=topic,
        msgtype="std_msgs/msg/String",
        time_ns=time_ns,
        payload=payload,
        publisher=SimpleNamespace(on_demand=False),
    )


def hashes(samples: list[Any], seconds: int, states: str = "abcdefgh") -> RunHashes:
    digest = RunDigest()
    for second in range(seconds):
        for one in samples:
            if second * SECOND < one.time_ns <= (second + 1) * SECOND:
                digest.on_sample(one)
        digest.end_second(f"state {states[second]}".encode()[::-1])
    return digest.hashes(b"end")


SAMPLES = [
    sample(topic, tick * SECOND // 4, f"{topic} {tick}".encode())
    for tick in range(1, 17)
    for topic in ("/a", "/b")
]


@pytest.mark.parametrize(
    "change",
    [
        {"payload": b"another"},
        {"time_ns": 9 * SECOND // 4 + 1},
        {"topic": "/a", "payload": b""},
    ],
)
def test_one_sample_that_differs_is_told_by_topic_and_second(change: dict[str, Any]) -> None:
    index = SAMPLES.index(sample("/a", 9 * SECOND // 4, b"/a 9"))
    changed = [*SAMPLES]
    changed[index] = SimpleNamespace(**vars(SAMPLES[index]) | change)
    a, b = hashes(SAMPLES, 4), hashes(changed, 4)
    assert a.stream[:2] == b.stream[:2]
    assert all(one != other for one, other in zip(a.stream[2:], b.stream[2:], strict=True))  # of all so far
    name = "/a std_msgs/msg/String"
    assert [second for second in range(4) if a.topics[name][second] != b.topics[name][second]] == [2]
    assert a.topics["/b std_msgs/msg/String"] == b.topics["/b std_msgs/msg/String"]


def test_order_within_a_topic_and_among_topics_is_told() -> None:
    swapped = [*SAMPLES]
    swapped[0], swapped[1] = swapped[1], swapped[0]
    a, b = hashes(SAMPLES, 4), hashes(swapped, 4)
    assert a.topics == b.topics
    assert a.stream != b.stream

    twice = [*SAMPLES, sample("/a", SECOND, b"x"), sample("/a", SECOND, b"y")]
    other = [*SAMPLES, sample("/a", SECOND, b"y"), sample("/a", SECOND, b"x")]
    assert hashes(twice, 4).topics != hashes(other, 4).topics


def test_the_physics_state_at_the_end_of_each_second_is_told() -> None:
    a, b = hashes(SAMPLES, 4), hashes(SAMPLES, 4, states="abxd")
    assert [one == other for one, other in zip(a.physics, b.physics, strict=True)] == [
        True,
        True,
        False,
        True,
    ]
    assert a.stream == b.stream


def test_what_comes_after_the_last_whole_second_is_told_too() -> None:
    digest = RunDigest()
    digest.end_second(b"state")
    digest.on_sample(sample("/a", SECOND + 1, b"late"))
    found = digest.hashes(b"end")
    assert list(found.topics["/a std_msgs/msg/String"]) == [1]
    assert len(found.stream) == len(found.physics) == 2
    assert digest.hashes(b"end") == found


def test_plain_values_are_small_and_become_the_same_hashes() -> None:
    many = [
        sample(f"/robot/some/topic_{topic}", (second + 1) * SECOND, b"x")
        for second in range(240)
        for topic in range(60)
    ]
    found = hashes(many, 240, states="a" * 240)
    text = json.dumps(found.to_dict())
    assert len(text) < 100_000
    assert RunHashes.from_dict(json.loads(text)) == found


@pytest.mark.parametrize("values", [{}, {"stream": "?", "physics": "", "topics": {}}, {"stream": 3}])
def test_other_values_are_refused(values: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="not the hashes of a run"):
        RunHashes.from_dict(values)
