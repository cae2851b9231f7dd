"""A process that no run waits for: it listens, asks, and interferes until the run is over.

Argument: endpoint. Prints "ready" when it listens, and one line of JSON.
"""

from __future__ import annotations

import json
import sys
import time

from twin.bridge import live
from twin.bridge.conversions import twist_from_planar
from twin.bridge.graph import Graph
from twin.bridge.msgs import Odometry, Parameter, ParameterType, ParameterValue, Twist, new
from twin.bridge.services import Future
from twin.bridge.srvs import ListParameters, SetParameters
from twin.errors import BridgeError


def main() -> None:
    end = time.monotonic() + 100
    while True:
        try:
            with live.join([sys.argv[1]]) as process:
                sys.stdout.write(json.dumps(watch(process, end)) + "\n")
            return
        except BridgeError:
            if time.monotonic() > end:
                raise


def watch(process: live.LiveBus, end: float) -> dict[str, object]:
    node = process.bus.create_node("stranger")
    odometry: list[Odometry] = []
    commands: list[Twist] = []
    node.create_subscription(Odometry, "/odom", odometry.append)
    node.create_subscription(Twist, "/cmd_vel", commands.append)
    publisher = node.create_publisher(Twist, "/cmd_vel")
    graph = Graph.watch(process.bus)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    process.spin(lambda: bool(odometry), timeout_s=end - time.monotonic())
    names = [info.full_name for info in graph.nodes]
    base = names[0]
    client = node.create_client(ListParameters, f"{base}/list_parameters")
    process.spin(lambda: client.service_is_ready, timeout_s=5.0)
    asked: Future = client.call_async(new(ListParameters.Request))
    value = new(ParameterValue)
    value.type, value.double_value = ParameterType.PARAMETER_DOUBLE, 0.01
    request = SetParameters.Request([Parameter("max_vel_x", value)])
    changed: Future = node.create_client(SetParameters, f"{base}/set_parameters").call_async(request)
    own = process.bus.session_id

    def over() -> bool:
        publisher.publish(twist_from_planar(-1.0, 2.0))
        return not any(info.session_id != own for info in graph.nodes)

    process.spin(over, timeout_s=end - time.monotonic())
    others = [message for message in commands if message.linear.x != -1.0]
    return {
        "odom": len(odometry),
        "commands": len(others),
        "nodes": names,
        "parameters": asked.done and asked.error is None,
        "set": changed.done and changed.error is None,
    }


if __name__ == "__main__":
    main()
