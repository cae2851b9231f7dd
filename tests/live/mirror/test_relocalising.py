"""Localisation that has been lost is asked to look for its robot."""

from __future__ import annotations

import numpy as np

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.srvs import Empty
from twin.geometry import Pose2
from twin.live.divergence.evidence import Fit, Lost
from twin.live.divergence.scans import Scan, compare
from twin.live.mirror.relocalising import Relocalising

SECOND = 1_000_000_000
HALF_NS = SECOND // 2
NOTHING = Scan(stamp_ns=0, angle_min=0.0, angle_increment=0.1, range_max=10.0, ranges=np.full(4, np.inf))
FIT = Fit(match=compare(NOTHING, NOTHING, Pose2(0.0, 0.0, 0.0)), pose=Pose2(0.0, 0.0, 0.0), on_map=True)


def test_it_is_asked_to_look_then_to_begin_from_no_idea_and_again_if_that_did_not_help() -> None:
    clock = Clock()
    bus = Bus.open(clock)
    amcl, asked = bus.create_node("amcl", "/bot"), list[tuple[str, int]]()
    for name in ("request_nomotion_update", "reinitialize_global_localization"):

        def answer(_request: Empty.Request, name: str = name) -> Empty.Response:
            asked.append((name, clock.now_ns // SECOND))
            return Empty.Response()

        amcl.create_service(Empty, name, answer)
    relocalising, told = Relocalising(bus.create_node("mirror", "/twin/bot"), "/bot"), []
    for tick in range(100):
        clock.now_ns = tick * HALF_NS
        lost_s = None if 80 <= tick < 84 else clock.now_ns * 1e-9 - (42.0 if tick >= 84 else 0.0)
        text = relocalising.update(clock.now_ns, None if lost_s is None else Lost(for_s=lost_s, fit=FIT))
        if text:
            told.append(text)
        bus.spin()
    bus.close()
    looked = [at_s for name, at_s in asked if name == "request_nomotion_update"]
    everywhere = [at_s for name, at_s in asked if name == "reinitialize_global_localization"]
    assert looked[0] == 1
    assert everywhere == [10, 30], "found for a moment at 40 s, so that it has again 10 s from 42 s on"
    assert len(told) == len(everywhere)
    assert told[0] == "lost for 10 s: it is asked to look for the robot everywhere"
