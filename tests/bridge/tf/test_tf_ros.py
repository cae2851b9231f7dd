"""What tf2_ros adds to the buffer: who broadcast, waiting, reports, throttling."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from functools import partial

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.tf import (
    DisconnectedFramesError,
    ExtrapolationError,
    InvalidFrameError,
    StaticTransformBroadcaster,
    TransformBroadcaster,
    TransformBuffer,
    TransformListener,
    TransformTimeoutError,
    UnknownFrameError,
    transform_stamped,
)
from twin.bridge.tf.report import frame_infos, graphviz, svg, text_tree
from twin.bridge.tf.rigid import Rigid
from twin.bridge.tf.walk import solve
from twin.errors import BridgeError
from twin.geometry import Pose3
from twin.nodes.tf_throttle import ThrottleConfig, TransformThrottle

S = 1_000_000_000
identity = Pose3.from_xyz_rpy()


def test_what_a_clock_stamped_before_it_was_set_back_is_not_the_latest(bus: Bus) -> None:
    TransformListener(buffer := TransformBuffer(), bus.create_node("listener"))
    driver = TransformBroadcaster(bus.create_node("driver"))

    def moved(now_ns: int, stamp_ns: int, x: float) -> float:
        bus.clock.now_ns = now_ns
        pose = Pose3.from_xyz_rpy((x, 0.0, 0.0))
        driver.send_transform(transform_stamped("odom", "base", stamp_ns, pose))
        bus.spin()
        return buffer.lookup_planar("odom", "base").x

    assert moved(4000 * S, 4000 * S, 1.0) == 1.0
    assert moved(400 * S, 400 * S, 2.0) == 2.0
    assert moved(400 * S + 1, 4000 * S + 1, 3.0) == 2.0, "it was under way"
    assert moved(401 * S, 401 * S, 4.0) == 4.0


def test_an_error_names_who_broadcast(bus: Bus) -> None:
    TransformListener(buffer := TransformBuffer(), bus.create_node("listener"))
    driver = TransformBroadcaster(bus.create_node("driver", "/robot"))
    mounts = StaticTransformBroadcaster(bus.create_node("mounts"))
    for stamp in (4 * S, 5 * S):
        driver.send_transform(transform_stamped("odom", "base", stamp, identity))
    mounts.send_transform(transform_stamped("base", "laser", 0, identity))
    bus.spin()
    with pytest.raises(ExtrapolationError) as caught:
        buffer.lookup("odom", "laser", 5 * S + 20_000)
    assert str(caught.value) == (
        "'odom' -> 'base' (from /robot/driver) is known from 4.000 s to 5.000 s; asked at 5.00002 s, "
        "0.00002 s after the last (looking up 'laser' in 'odom')"
    )
    assert {info.frame: info.broadcaster for info in frame_infos(buffer)} == {
        "base": "/robot/driver",
        "laser": "/mounts",
    }


def test_a_single_sample_is_known_only_then() -> None:
    buffer = TransformBuffer()
    buffer.set_transform("odom", "base", 4 * S, identity, authority="me")
    with pytest.raises(
        ExtrapolationError, match=r"\(from me\) is known only at 4\.000 s; asked at 3\.000 s, 1\.0"
    ):
        buffer.lookup("odom", "base", 3 * S)


def test_a_frame_that_is_no_longer_static_starts_anew() -> None:
    buffer = TransformBuffer()
    buffer.set_transform("odom", "base", 0, identity, static=True)
    assert buffer.can_transform("odom", "base", 9 * S)
    buffer.set_transform("odom", "base", 5 * S, identity)
    assert not buffer.can_transform("odom", "base", 9 * S)
    buffer.set_transform("odom", "base", 5 * S, identity, static=True)
    assert buffer.can_transform("odom", "base", 9 * S)


def test_names_are_those_of_tf2() -> None:
    buffer = TransformBuffer()
    buffer.set_transform("/odom", "/base", 0, identity, static=True)
    assert buffer.frame_names == ("base", "odom")
    with pytest.raises(InvalidFrameError, match="valid is 'odom'"):
        buffer.lookup("/odom", "base")
    buffer.set_transform("a", "b", S, identity)
    buffer.set_transform("b", "a", S, identity)
    with pytest.raises(UnknownFrameError, match="loop: a -> b -> a"):
        buffer.lookup("a", "base")


def test_a_chain_of_frames() -> None:
    buffer = TransformBuffer()
    for parent, child in (("map", "odom"), ("odom", "base"), ("base", "laser"), ("map", "dock"), ("x", "y")):
        buffer.set_transform(parent, child, S, identity)
    assert buffer.chain("dock", "laser") == ["laser", "base", "odom", "map", "dock"]
    assert buffer.chain("map", "base") == ["base", "odom", "map"]
    assert buffer.chain("base", "map") == ["map", "odom", "base"]
    with pytest.raises(DisconnectedFramesError):
        buffer.chain("y", "map")


edges = st.tuples(
    st.sampled_from("abcdef"),
    st.sampled_from("abcdef"),
    st.integers(1, 12).map(lambda t: t * S),
    st.floats(-5, 5),
    st.floats(-math.pi, math.pi),
    st.booleans(),
).filter(lambda edge: edge[0] != edge[1])


@given(
    st.lists(edges, max_size=25), st.lists(st.tuples(*[st.sampled_from("abcdef")] * 2, st.integers(0, 26)))
)
def test_the_short_way_gives_what_the_walk_gives(
    sets: list[tuple[str, str, int, float, float, bool]], asked: list[tuple[str, str, int]]
) -> None:
    buffer = TransformBuffer()
    for parent, child, time_ns, x, yaw, static in sets:
        pose = Pose3.from_xyz_rpy((x, 0.0, 1.0), (0.0, 0.0, yaw))
        buffer.set_transform(parent, child, time_ns, pose, static=static)
    for target, source, half in asked:
        if target == source or not {target, source} <= set(buffer.frame_names):
            continue
        expected = outcome(partial(solve, buffer.frames, target, source, half * S // 2))
        got = outcome(partial(buffer.lookup_stamped, target, source, half * S // 2))
        assert got == pytest.approx(expected, abs=1e-9) if isinstance(expected, list) else got == expected


def test_a_loop_of_the_past_is_named() -> None:
    buffer = TransformBuffer()
    for parent, child, time_ns in (("a", "b", S), ("b", "a", S), ("c", "a", 2 * S)):
        buffer.set_transform(parent, child, time_ns, identity)
    with pytest.raises(UnknownFrameError, match="loop: a -> b -> a"):
        buffer.lookup_stamped("a", "c", S)
    with pytest.raises(UnknownFrameError, match="loop: b -> a -> b"):
        buffer.lookup_stamped("c", "b", S)


def outcome(look_up: Callable[[], tuple[Rigid, int]]) -> list[float] | type[Exception]:
    try:
        value, time_ns = look_up()
    except BridgeError as error:
        return type(error)
    return [*value, time_ns]


def test_waiting_ends_in_the_spin_that_brings_the_transform(bus: Bus, clock: Clock) -> None:
    node = bus.create_node("listener")
    buffer = TransformBuffer()
    listener = TransformListener(buffer, node)
    broadcaster = TransformBroadcaster(bus.create_node("driver"))
    future = listener.wait_for_transform_async("odom", "base", 2 * S, timeout_ns=5 * S)
    forever = buffer.wait_for_transform_async("odom", "base", 2 * S)
    got: list[bool] = []
    future.add_done_callback(lambda done: got.append(done.result))
    for stamp in (S, 3 * S):
        assert not future.done
        clock.now_ns = stamp
        broadcaster.send_transform(transform_stamped("odom", "base", stamp, identity))
        bus.spin()
        bus.spin()
    assert got == [True]
    assert forever.done
    assert buffer.wait_for_transform_async("odom", "base", 2 * S).done


def test_waiting_ends_at_its_time_out_and_says_why(bus: Bus, clock: Clock) -> None:
    node = bus.create_node("listener")
    buffer = TransformBuffer()
    listener = TransformListener(buffer, node)
    future = listener.wait_for_transform_async("odom", "base", None, timeout_ns=S)
    with pytest.raises(BridgeError, match="yet"):
        _ = future.result
    clock.now_ns = S - 20_000_000
    bus.spin()
    assert not future.done
    clock.now_ns = S + 10_000_000
    bus.spin()
    with pytest.raises(
        TransformTimeoutError, match=r"at 1\.010 s the wait is over: the frame 'odom' is not in"
    ):
        _ = future.result


def example() -> TransformBuffer:
    buffer = TransformBuffer()
    for i in range(21):
        buffer.set_transform("odom", "base", S + i * S // 20, identity, authority="/driver")
    buffer.set_transform("base", 'the "laser"', 0, identity, static=True, authority="/mounts")
    return buffer


def test_the_yaml_that_view_frames_reads() -> None:
    text = example().all_frames_as_yaml(now_ns=3 * S)
    assert text.startswith("base: \n  parent: 'odom'\n  broadcaster: '/driver'\n  rate: 21.000\n")
    assert yaml.safe_load(text.replace('the "laser"', "laser"))["base"] == {
        "parent": "odom",
        "broadcaster": "/driver",
        "rate": 21.0,
        "most_recent_transform": 2.0,
        "oldest_transform": 1.0,
        "transform_delay": 1.0,
        "buffer_length": 1.0,
    }
    assert TransformBuffer().all_frames_as_yaml() == "[]"
    assert example().all_frames_as_string().splitlines()[0] == "Frame base exists with parent odom."


def test_drawings_of_any_tree() -> None:
    infos = frame_infos(example())
    assert '"base" -> "the \\"laser\\""' in graphviz(infos, S)
    assert "the &quot;laser&quot;" in svg(infos, S) or 'the "laser"' in svg(infos, S)
    loop = TransformBuffer()
    loop.set_transform("a", "b", S, identity)
    loop.set_transform("b", "a", S, identity)
    for draw in (graphviz, svg):
        assert "b" in draw(frame_infos(loop), S)
        assert "No tf data received" in draw((), S)
    assert text_tree(frame_infos(loop)).count("\n") >= 2
    assert text_tree(()) == ""


def test_a_loop_is_shown_beside_a_tree() -> None:
    buffer = example()
    for parent, child in (("x", "y"), ("y", "x"), ("y", "z")):
        buffer.set_transform(parent, child, S, identity)
    infos = frame_infos(buffer)
    frames = [line.split("  (")[0] for line in text_tree(infos).splitlines()]
    assert frames == ["odom", "└── base", '    └── the "laser"', "x", "└── y", "    ├── x", "    └── z"]
    assert svg(infos, S).count("<rect") == 1 + 6


def test_a_chain_may_be_deeper_than_python_calls() -> None:
    buffer, depth = TransformBuffer(), 2 * sys.getrecursionlimit()
    for number in range(depth):
        buffer.set_transform(f"f{number}", f"f{number + 1}", S, identity, static=True)
    infos = frame_infos(buffer)
    assert text_tree(infos).count("\n") == depth + 1
    assert svg(infos, S).count("<rect") == 1 + depth + 1
    assert graphviz(infos, S).count("->") == depth + 1


def at(x: float = 0.0, yaw: float = 0.0) -> Rigid:
    return x, 0.0, 0.0, math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)


def test_throttling_by_time() -> None:
    throttle = TransformThrottle(ThrottleConfig(rate=10.0))
    sent = [t for t in range(0, 1000, 40) if throttle.is_due(at(), t * 1_000_000)]
    assert sent == list(range(0, 1000, 120))
    assert throttle.is_due(at(), 0), "a bag that starts again"


def test_throttling_by_distance_and_angle() -> None:
    throttle = TransformThrottle(ThrottleConfig(rate=100.0, trans_thres=0.1, angular_thres=0.2))
    path = [at(), at(0.05), at(0.11), at(0.11, 0.19), at(0.11, -0.19), at(0.11, 0.21), at(0.2, 0.3)]
    assert [throttle.is_due(pose, i * S) for i, pose in enumerate(path)] == [
        True, False, True, False, False, True, False,
    ]  # fmt: skip
    far = TransformThrottle(ThrottleConfig(rate=100.0, trans_thres=0.1))
    assert [far.is_due(pose, i * S) for i, pose in enumerate([at(), at(0.0, 3.0), at(0.2)])] == [
        True,
        False,
        True,
    ]
    q_and_minus_q = TransformThrottle(ThrottleConfig(angular_thres=0.1))
    assert q_and_minus_q.is_due(at(), 0)
    assert not q_and_minus_q.is_due((0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0), S)


@pytest.mark.parametrize("wrong", [{"rate": 0.0}, {"trans_thres": -1.0}, {"angular_thres": math.nan}])
def test_limits_that_mean_nothing_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(BridgeError, match=f"{next(iter(wrong))} of a transform throttle"):
        ThrottleConfig(**wrong)
