"""A hall without physics for the page: a robot that stands somewhere, and what a test adds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from tests.web.serving import serving
from tests.web.test_page import CHROMIUM, PATIENCE_S
from twin.bridge.bus import Bus
from twin.bridge.conversions import pose_from_pose2
from twin.bridge.msgs import Odometry, TFMessage, TransformStamped, header, new
from twin.bridge.qos import LATCHED
from twin.geometry import Pose2
from twin.nodes.navigation.mapping.map_server import grid_msg
from twin.web.rosbridge.process import PAGE
from twin.web.rosbridge.server import ServerConfig


class Robot:
    """Publishes `odom`, transforms and a latched map, while it `speaks`."""

    def __init__(self, bus: Bus, data: Any, pose: Pose2, namespace: str = "") -> None:
        self.node = bus.create_node("robot", namespace)
        self.pose = pose
        self.speaks = True
        self.prefix = f"{namespace}_" if namespace else ""
        self.odometry = self.node.create_publisher(Odometry, "odom", 1)
        self.transforms = self.node.create_publisher(TFMessage, "/tf", 10)
        self.map = self.node.create_publisher(type(self.grid(data)), "map", LATCHED)
        self.map.publish(self.grid(data))
        self.node.create_timer(50_000_000, self.tell)

    def grid(self, data: Any) -> Any:
        return grid_msg(np.asarray(data, np.int8), 0.05, Pose2(-1.0, -1.0, 0.0), "map", self.node.now_ns)

    def tell(self) -> None:
        if not self.speaks:
            return
        now_ns, odom, base = self.node.now_ns, f"{self.prefix}odom", f"{self.prefix}base_link"
        message = new(Odometry, header=header(now_ns, odom), child_frame_id=base)
        message.pose.pose = pose_from_pose2(self.pose)
        self.odometry.publish(message)
        links = []
        for parent, child, pose in (("map", odom, Pose2(0, 0, 0)), (odom, base, self.pose)):
            link = new(TransformStamped, header=header(now_ns, parent), child_frame_id=child)
            link.transform.translation.x, link.transform.translation.y = pose.x, pose.y
            link.transform.rotation = pose_from_pose2(pose).orientation
            links.append(link)
        self.transforms.publish(TFMessage(links))


def walls(height: int, width: int) -> Any:
    """Return cells of a hall: free, with walls around it."""
    data = np.zeros((height, width), np.int8)
    data[[0, -1]] = data[:, [0, -1]] = 100
    return data


@contextmanager
def opened(address: str, width: int = 1280, height: int = 800, *, ready: bool = True) -> Iterator[Any]:
    """The page in a browser, once it shows a robot."""
    driver_of = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with driver_of.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox"])
        page = browser.new_page(
            viewport={"width": width, "height": height}, color_scheme="dark", locale="en-GB"
        )
        page.set_default_timeout(PATIENCE_S * 1000)
        faults: list[str] = []
        page.on("pageerror", lambda fault: faults.append(str(fault)))
        page.goto(address)
        if ready:
            page.wait_for_selector("aside .grid")
        yield page
        browser.close()
        assert not faults


@contextmanager
def hall(
    data: Any = None, more: Callable[[Bus, Robot], Any] = lambda bus, robot: None, **config: Any
) -> Iterator[tuple[str, Any]]:
    """A bridge that serves the page, its address, and its server."""
    made: list[Robot] = []

    def nodes(bus: Bus) -> None:
        made.append(Robot(bus, walls(120, 160) if data is None else data, Pose2(1.0, 1.0, 0.5)))
        more(bus, made[0])

    with serving(ServerConfig(port=0, folders={"": PAGE}, **config), nodes=nodes) as server:
        yield server.server.address.replace("ws://", "http://") + "/", server
