"""Services, actions and parameters to talk to: `python service_graph.py ENDPOINT`; it ends with its input."""

from __future__ import annotations

import sys
import threading
from collections.abc import Generator
from typing import Any

import numpy as np

from twin.bridge import live, types
from twin.bridge.action_types import Fibonacci
from twin.bridge.actions.server import ActionServer, GoalHandle
from twin.bridge.msgs import ParameterDescriptor
from twin.bridge.srvs import AddTwoInts, Empty, SetBool
from twin.bridge.types.default_values import new

types.register("lab_interfaces/srv/Weigh", "string what\nuint8 times 1\n---\nfloat64 grams\n")
types.register("lab_interfaces/action/Count", "uint8 up_to\n---\nuint8 last\n---\nuint8 now\n")
Weigh = types.ServiceType("lab_interfaces/srv/Weigh")
Count = types.ActionType("lab_interfaces/action/Count")
FloatingPointRange = types.get("rcl_interfaces/msg/FloatingPointRange")


def fibonacci(handle: GoalHandle) -> Generator[None, None, Any]:
    """Add a number in each spin; wait for cancellation from 100 on."""
    sequence = [0, 1]
    while len(sequence) <= handle.request.order:
        if handle.is_cancel_requested:
            handle.canceled()
            break
        if len(sequence) < 20:
            sequence.append(sequence[-1] + sequence[-2])
            handle.publish_feedback(Fibonacci.Feedback(np.array(sequence, np.int32)))
        yield
    return Fibonacci.Result(np.array(sequence, np.int32))


def count(handle: GoalHandle) -> Generator[None, None, Any]:
    """Count, one number in each spin."""
    for now in range(1, handle.request.up_to + 1):
        handle.publish_feedback(Count.Feedback(now))
        yield
    return Count.Result(handle.request.up_to)


with live.join([], listen=[sys.argv[1]]) as process:
    kept: list[Any] = []
    adder = process.bus.create_node("adder")
    adder.create_service(AddTwoInts, "add_two_ints", lambda r: AddTwoInts.Response(r.a + r.b))
    adder.create_deferred_service(Empty, "never_answers", lambda request, respond: kept.append(respond))
    base = process.bus.create_node("base", "/robot")
    base.create_service(
        SetBool, "stop", lambda r: SetBool.Response(r.data, "stopped" if r.data else "goes on")
    )
    base.create_client(AddTwoInts, "/add_two_ints")
    base.create_service(Empty, "_hidden", lambda r: Empty.Response(0))
    acting = process.bus.create_node("fibonacci_action_server")
    ActionServer(acting, Fibonacci, "fibonacci", fibonacci, goal_callback=lambda goal: goal.order > 0)

    lab = process.bus.create_node("lab")
    lab.create_service(Weigh, "weigh", lambda r: Weigh.Response(2.5 * r.times))
    ActionServer(lab, Count, "count", count)
    settings = process.bus.create_node("settings")
    for name, value in {
        "robot_name": "r2d2",
        "camera_on": True,
        "wheels": 4,
        "gains.p": 1.5,
        "gains.limits": [0.5, 1.0],
        "version": "1e-3",
        "names": ["a", "1"],
    }.items():
        settings.declare_parameter(name, value)
    limits = FloatingPointRange(0.0, 2.0, 0.0)
    settings.declare_parameter(
        "max_speed", 0.5, new(ParameterDescriptor, description="Of the wheels", floating_point_range=[limits])
    )
    settings.declare_parameter("serial", 7, new(ParameterDescriptor, read_only=True))
    settings.declare_parameter("anything", 1, new(ParameterDescriptor, dynamic_typing=True))

    over = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), over.set()), daemon=True).start()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    process.spin(until=over.is_set)
