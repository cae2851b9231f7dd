from __future__ import annotations

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.graph import Graph
from twin.bridge.srvs import Trigger


def test_a_process_sees_more_of_its_own_endpoints_than_a_queue_of_zenoh_holds() -> None:
    with Bus.open(Clock()) as bus:
        node = bus.create_node("many")
        for number in range(400):
            node.create_service(Trigger, f"service_{number}", lambda request: None)
        assert len(Graph.snapshot(bus).services()) >= 400
