"""A map server that listens, until its input ends."""

from __future__ import annotations

import select
import sys

import numpy as np

from twin.bridge import live
from twin.geometry import Pose2
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.nodes.navigation.mapping.map_server import MapServerNode

CELLS = [[0, 0, 0, 100], [-1, 0, 0, 0], [0, 100, 0, 0]]

with live.join((), listen=[sys.argv[1]]) as process:
    room = OccupancyMap(data=np.array(CELLS, np.int8), resolution=0.05, origin=Pose2(-1.5, 0.0, 0.0))
    MapServerNode(process.bus, room)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    while not select.select([sys.stdin], [], [], 0)[0]:
        process.spin_once(0.05)
