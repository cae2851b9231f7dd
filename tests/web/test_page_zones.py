"""Keep-out zones: who may draw them, and how the page does."""

from __future__ import annotations

from typing import Any

import pytest

from tests.web.conftest import World
from tests.web.hall import Robot, hall, opened
from tests.web.test_page import CHROMIUM, eventually, violations
from twin.bridge.bus import Bus
from twin.nodes.navigation.costmaps.vector_objects import VectorObjectServerConfig, VectorObjectServerNode
from twin.web.rosbridge.access import ROLES, Token

CONTRAST = """(element) => {
    const light = (colour) => {
        const linear = (c) => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
        const [r, g, b] = colour.match(/[0-9.]+/g).map((value) => linear(value / 255));
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const { color, backgroundColor } = getComputedStyle(element);
    const [a, b] = [light(color), light(backgroundColor)];
    return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
}"""
"""Of an element's text, as WCAG has it; axe leaves out what is disabled."""
SECRETS = "viewer-0123456789", "operator-0123456789"


def zones(bus: Bus, robot: Robot | None = None) -> VectorObjectServerNode:
    return VectorObjectServerNode(bus, VectorObjectServerConfig(), lambda: None)


@pytest.mark.parametrize("service", ["add_shapes", "remove_shapes"])
def test_who_watches_draws_no_zones_and_one_steers_at_a_time(world: World, service: str) -> None:
    zones(world.bus)
    name = f"/vector_object_server/{service}"
    viewer, mei, lin = world.client("viewer"), world.client("operator"), world.client("operator")
    told = viewer.tell("call_service", service=name, args={}, id="1")
    assert [m["result"] for m in told if m["op"] == "service_response"] == [False]
    assert "not for the role viewer" in str(told)
    listed = viewer.tell("call_service", service="/vector_object_server/get_shapes", id="2")
    assert listed[-1]["values"] == {"circles": [], "polygons": []}
    assert mei.tell("call_service", service=name, args={}, id="3")[-1]["result"] is True
    assert "has control" in str(lin.tell("call_service", service=name, args={}, id="4"))
    assert [line["target"] for line in world.lines if line["name"].endswith("#2")] == [name]


@pytest.mark.long
@pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no browser at {CHROMIUM}")
def test_a_zone_is_drawn_listed_kept_and_removed() -> None:
    with hall(more=zones) as (address, _), opened(address) as page:
        page.click("#tool-zone")
        for _theme in range(2):
            page.mouse.move(10, 10)
            assert page.locator("#zone-add:disabled").evaluate(CONTRAST) > 4.5, (
                "what cannot be pressed yet is read"
            )
            page.click("#theme")
        page.click("#tool-zone")
        corners = ((500, 250), (700, 250), (700, 400), (500, 400))
        draw(page, [corners[i] for i in (0, 2, 1, 3)])
        page.click("#zone-add")
        page.wait_for_selector("[role=alert]")
        assert "cross" in page.inner_text("[role=alert]")
        for _ in range(4):
            page.click("text=Undo corner")
        draw(page, corners, is_open=True)
        page.click("#zone-add")
        page.click("#tab-zones")
        page.wait_for_selector("#zone-list li")
        assert "4 corners" in page.inner_text("#zone-list")
        assert page.locator("#zone-add").count() == 0, "drawn, the tool is put away"

        # It lives at the robot's side: the page may go.
        page.reload()
        page.click("#tab-zones")
        page.wait_for_selector("#zone-list li")

        # By the keyboard alone.
        page.focus("#zone-draft")
        page.keyboard.type("0 0\n1 0\nx 1")
        page.keyboard.press("Tab")
        page.keyboard.press("Enter")
        page.wait_for_selector("text=two numbers")
        page.focus("#zone-draft")
        for _ in range(3):
            page.keyboard.press("Backspace")
        page.keyboard.type("1 1")
        page.keyboard.press("Tab")
        page.keyboard.press("Enter")
        page.wait_for_selector("#zone-list li:nth-child(2)")

        # What only the robot knows, it says.
        page.fill("#zone-draft", "900 900\n901 900\n901 901")
        page.press("#zone-draft", "Tab")
        page.keyboard.press("Enter")
        page.wait_for_selector("text=The robot refuses this zone")
        page.click("#tab-log")
        page.wait_for_selector("text=no cell of the mask lies in the zone")

        page.click("#tab-zones")
        for _language in range(2):
            for _theme in range(2):
                assert violations(page) == []
                page.click("#theme")
            page.click("#language")
        page.click("#zone-list li:nth-child(1) button")
        page.click("#zone-list li:nth-child(1) button")  # really
        eventually(lambda: page.locator("#zone-list li").count() == 1, "it is removed")
        page.set_viewport_size({"width": 360, "height": 740})
        page.click("#tool-zone")
        assert page.evaluate("document.documentElement.scrollWidth") <= 360
        assert violations(page) == []


@pytest.mark.long
@pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no browser at {CHROMIUM}")
def test_who_only_watches_sees_zones_and_no_tools_for_them() -> None:
    tokens = tuple(
        Token(secret, ROLES[role], role) for secret, role in zip(SECRETS, ("viewer", "operator"), strict=True)
    )
    with hall(more=zones, tokens=tokens) as (address, _), opened(f"{address}?token={SECRETS[1]}") as page:
        draw(page, ((500, 250), (700, 250), (700, 400)))
        page.click("#zone-add")
        page.wait_for_selector("#zone-add", state="detached")
        page.goto(f"{address}?token={SECRETS[0]}")
        page.click("#tab-zones")
        page.wait_for_selector("#zone-list li")
        assert page.locator("#tool-zone, #zone-draft, #zone-list button:visible").count() == 0


def draw(page: Any, corners: Any, *, is_open: bool = False) -> None:
    if not is_open:
        page.click("#tool-zone")
    for x, y in corners:
        page.locator("canvas.map").click(position={"x": x, "y": y})
