from __future__ import annotations

import gc
import json
import random
import tracemalloc
from typing import Any

import pytest

from tests.web.conftest import World
from twin.errors import BridgeError
from twin.web.rosbridge.frames import from_json

OPS = (
    "advertise", "unadvertise", "publish", "publish", "subscribe", "subscribe", "unsubscribe",
    "call_service", "advertise_service", "unadvertise_service", "service_response",
    "send_action_goal", "cancel_action_goal", "advertise_action", "unadvertise_action",
    "action_feedback", "action_result", "set_level", "status", "auth", "fragment", "png",
)  # fmt: skip
NAMES = ("/a", "b", "/cmd_vel", "/c/d", "/rosapi/topics", "/rosapi/get_param", "/twin/control", "/fib")
TYPES = (
    "std_msgs/String", "geometry_msgs/msg/Twist", "std_srvs/Trigger", "sensor_msgs/LaserScan",
    "action_tutorials_interfaces/action/Fibonacci", "nonsense/msg/No",
)  # fmt: skip
OBJECTS = (
    {}, {"data": "x"}, {"linear": {"x": 1}}, {"linear": {"x": None}}, {"command": "take_over"},
    {"order": 3}, {"ranges": [1, None]}, {"header": {"stamp": {"sec": -1}}}, {"name": "/a:b"},
)  # fmt: skip
FITTING: dict[str, tuple[Any, ...]] = {
    "topic": NAMES, "service": NAMES, "action": NAMES, "type": TYPES, "action_type": TYPES,
    "msg": OBJECTS, "args": OBJECTS, "values": OBJECTS, "id": ("1", "2"), "result": (True, False),
    "status": (4, 5, 6), "level": ("none", "error", "info"), "data": ('{"op":', '"x"}', "{}"),
    "num": (0, 1), "total": (1, 2), "throttle_rate": (0, 10), "queue_length": (0, 2),
    "fragment_size": (1, 50), "compression": ("none", "png", "cbor", "cbor-raw"),
    "latch": (True, False), "timeout": (0, 1), "feedback": (True,),
}  # fmt: skip
STRANGE: tuple[Any, ...] = (
    "", "~", "a b", "\ud83d\ude00", "x" * 1000, 0, -1, 1e308, 2**70, True, None, [], {}, [[[]]], {"x": {}},
)  # fmt: skip


def frame(chance: random.Random) -> str:
    fields = [name for name in FITTING if chance.random() < 0.7]
    message = {name: chance.choice(FITTING[name] if chance.random() < 0.95 else STRANGE) for name in fields}
    text = json.dumps({"op": chance.choice(OPS), **message})
    if chance.random() < 0.1:
        text = text[: chance.randrange(len(text))]
    if chance.random() < 0.05:
        at = chance.randrange(len(text) + 1)
        text = text[:at] + chance.choice(("\0", "\ud800", '"', "{", "}", "é")) + text[at:]
    return text


def attack(world: World, frames: int, seed: int) -> int:
    chance, client, handled = random.Random(seed), world.client(), 0
    for number in range(frames):
        try:
            client.session.handle(from_json(frame(chance)))
            handled += 1
        except BridgeError:
            pass  # no JSON: the server tells
        if number % 100 == 99:
            world.spin(0.1)
            client.frames.clear()
        if number % 2000 == 1999:
            client.session.close()
            world.spin(20.0)
            client = world.client()
    client.session.close()
    world.spin(20.0)
    return handled


@pytest.mark.parametrize("frames", [4_000, pytest.param(100_000, marks=pytest.mark.long)])
def test_no_frame_does_harm_or_leaves_something(world: World, frames: int) -> None:
    attack(world, frames // 2, 1)
    gc.collect()
    tracemalloc.start()
    try:
        handled = attack(world, frames // 2, 2)
        world.lines.clear()
        gc.collect()
        grown = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    assert handled > frames // 4
    assert grown < 2_000_000
    client = world.client()
    assert client.tell("call_service", service="/rosapi/topics")[0]["result"]
    bridge = world.bridge
    assert not bridge.topics._sources
    assert not bridge.topics._outlets
    assert not bridge.calls._open
    assert not bridge.goals._offered
