"""The page on a telephone, with one robot and with several: what matters most is seen whole."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest

from tests.web.hall import Robot, hall, opened
from tests.web.test_page import CHROMIUM, eventually, violations
from twin.bridge.bus import Bus
from twin.bridge.msgs import DiagnosticArray, DiagnosticStatus, Header, KeyValue, Odometry, header, new
from twin.bridge.qos import LATCHED

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no browser at {CHROMIUM}"),
]


class Guarded:
    """A robot's emergency stop, and that it is there; one that is `deaf` does not hear the stop."""

    def __init__(self, bus: Bus, space: str) -> None:
        self.node = bus.create_node(f"guarded{space.replace('/', '_')}")
        self.space, self.by, self.is_deaf = space, "", True
        self.odometry = self.node.create_publisher(Odometry, f"{space}/odom", 1)
        self.status = self.node.create_publisher(DiagnosticArray, f"{space}/guard/status", LATCHED)
        self.node.create_subscription(Header, f"{space}/guard/stop", self.stop, 1)
        self.node.create_timer(100_000_000, self.tell)

    def stop(self, message: Any) -> None:
        self.by = "" if self.is_deaf else message.frame_id

    def tell(self) -> None:
        if self.space:
            message = new(Odometry, header=header(self.node.now_ns, "odom"), child_frame_id="base_link")
            self.odometry.publish(message)
        status = new(DiagnosticStatus, name="guard", values=[KeyValue("stopped_by", self.by)])
        self.status.publish(DiagnosticArray(header(self.node.now_ns, ""), [status]))


BOXES = """() => [...document.querySelectorAll("header > *")]
    .map((each) => each.getBoundingClientRect()).filter(({ width }) => width)
    .map(({ x, width }) => ({ x, width }))"""
"""Where the parts of the header are that are seen [pixels]."""


def boxes(page: Any, width: int) -> None:
    """Nothing of the header is cut off or lies over something else."""
    page.set_viewport_size({"width": width, "height": 740})
    shown = page.evaluate(BOXES)  # at one time: what is in the header comes and goes
    stop = page.locator("header .stop").bounding_box()
    assert stop["x"] >= 0
    assert stop["x"] + stop["width"] <= width, page.inner_text("header")
    assert stop["width"] >= 90
    for before, after in pairwise(shown):
        assert before["x"] + before["width"] <= after["x"] + 1, page.inner_text("header")
    assert page.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize("spaces", [[""], ["", "/forklift_of_the_second_hall", "/red"]])
def test_stop_is_seen_whole_and_what_has_happened_is_said(spaces: list[str]) -> None:
    guards: list[Guarded] = []

    def more(bus: Bus, robot: Robot) -> None:
        guards.extend(Guarded(bus, space) for space in spaces)

    with hall(more=more) as (address, server), opened(address, 360, 740) as page:
        page.wait_for_selector("#stop:enabled")
        if len(spaces) > 1:
            eventually(lambda: page.locator("header option").count() == 3, "three robots")
            page.select_option("header select", spaces[1])
        for _language in range(2):
            for width in (320, 360, 412, 600, 601, 900):
                boxes(page, width)
            page.click("#language")
        page.set_viewport_size({"width": 320, "height": 740})
        page.click("#stop")
        for words in ("Stopping …", "正在停止 …"):
            eventually(lambda words=words: page.inner_text("#stop") == words, words)
            boxes(page, 320)
            page.click("#language")
        for guard in guards:
            guard.is_deaf = False
        page.wait_for_selector("#release")
        if len(spaces) == 1:
            return

        # Scrolled down, it is still said, and by whom; the alarm is in the page's language.
        page.click("#language")
        page.click("#tab-alarms")
        eventually(lambda: page.locator("li.alarm").count() == len(spaces), "an alarm for each")
        assert "紧急停止" in page.inner_text("#alarm-list")
        assert "emergency" not in page.inner_text("#panel")
        assert ":" in page.inner_text("li.alarm:first-child time"), "a time, though there is no clock"
        page.evaluate("scrollTo(0, 1e6)")
        assert page.evaluate("scrollY") > 0
        for seen in (".banner", "#release"):
            box = page.locator(seen).bounding_box()
            assert box["y"] >= 0, seen
            assert box["y"] + box["height"] <= 300, seen
        boxes(page, 320)
        page.click("#language")

        # A telephone has the layers, the time and the pace, too.
        page.click("#layers")
        page.click("#tool-scan[aria-pressed=true]")
        page.wait_for_selector("#tool-scan[aria-pressed=false]")
        assert "Pace" in page.inner_text(".display")
        assert violations(page) == []

        # Held across, the map is seen beside the panels.
        page.set_viewport_size({"width": 740, "height": 360})
        stage, panel = (page.locator(each).bounding_box() for each in (".stage", "aside"))
        assert stage["x"] + stage["width"] <= panel["x"]
        bars = [page.locator(f".bar.{side}").bounding_box() for side in ("top", "bottom")]
        assert bars[1]["y"] - bars[0]["y"] - bars[0]["height"] > 120, "some of the map is under no buttons"
        assert page.evaluate("document.documentElement.scrollWidth") <= 740
        page.set_viewport_size({"width": 360, "height": 740})

        # Which robot a goal of the page's queue is for.
        page.click("#tab-tasks")
        for space, of_all in (("", 1), (spaces[2], 2)):
            page.select_option("header select", space)
            page.click("#panel form button")
            eventually(lambda count=of_all: page.locator("#queue li").count() == count, "it is queued")
        assert page.locator("#queue .badge").all_inner_texts() == ["robot", "red"]

        # Without a connection that is said in words.
        server.server.close()
        page.wait_for_selector("#lost")
        page.evaluate("scrollTo(0, 1e6)")
        assert page.locator("#lost").bounding_box()["y"] >= 0
        for _theme in range(2):
            assert violations(page) == []
            page.click("#theme")
