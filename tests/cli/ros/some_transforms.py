"""Transforms to look at with commands: `python some_transforms.py ENDPOINT`; ends when its input closes."""

from __future__ import annotations

import math
import sys
import threading

from twin.bridge import live
from twin.bridge.tf import StaticTransformBroadcaster, TransformBroadcaster, transform_stamped
from twin.geometry import Pose3

with live.join([], listen=[sys.argv[1]]) as process:
    driver = process.bus.create_node("driver")
    moving = TransformBroadcaster(driver)
    half_turn = Pose3.from_xyz_rpy((1.0, 2.0, 0.0), (0.0, 0.0, math.pi / 2.0))
    driver.create_timer(
        20_000_000,
        lambda: moving.send_transform(transform_stamped("odom", "base_link", driver.now_ns, half_turn)),
    )
    mounts = process.bus.create_node("mounts", "/robot")
    upside_down = Pose3.from_xyz_rpy((0.5, 0.0, 0.25), (math.pi, 0.0, 0.0))
    StaticTransformBroadcaster(mounts).send_transform(
        [
            transform_stamped("base_link", "laser", 0, upside_down),
            transform_stamped("base_link", "imu", 0, Pose3.from_xyz_rpy()),
        ]
    )

    over = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), over.set()), daemon=True).start()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    process.spin(until=over.is_set)
