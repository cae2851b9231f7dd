"""The page and who steers: in a browser, beside a hall without physics."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from websockets.sync.client import ClientConnection, connect

from tests.web.hall import Robot, hall, opened
from tests.web.test_page import CHROMIUM, eventually, violations
from twin.bridge import types
from twin.bridge.bus import Bus
from twin.bridge.graph import Graph
from twin.bridge.msgs import PoseWithCovarianceStamped, Twist, TwistStamped
from twin.bridge.qos import LATCHED
from twin.geometry import Pose2
from twin.live.guard.gate import GateConfig
from twin.live.guard.node import GuardNode
from twin.web.rosbridge.access import ROLES, Token

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no browser at {CHROMIUM}"),
]
SECRETS = {"viewer": "viewer-0123456789", "operator": "operator-0123456789"}
TOKENS = tuple(Token(secret, ROLES[role], f"the {role}") for role, secret in SECRETS.items())
HANG = "() => { const until = Date.now() + 2000; while (Date.now() < until); }"
HIDE = "hidden => Object.defineProperty(document, 'hidden', {get: () => hidden, configurable: true})"
SOCKETS = """sockets = [];
WebSocket = class extends WebSocket { constructor(url) { super(url); sockets.push(this); } };"""
COUNT_ALERTS = """() => {
    window.alerts = 0;
    const count = node => alerts += node.getAttribute?.('role') === 'alert';
    const watch = new MutationObserver(all => all.forEach(({addedNodes}) => addedNodes.forEach(count)));
    watch.observe(document.body, {childList: true, subtree: true});
}"""
STOPPED_S = 0.6


class Heard:
    """Velocities on some topics: when [s], and how fast."""

    def __init__(self) -> None:
        self.speeds: dict[str, list[tuple[float, float]]] = {}

    def listen(self, bus: Bus, topic: str, kind: type[Any] = Twist) -> None:
        said = self.speeds.setdefault(topic, [])

        def on(message: Any) -> None:
            said.append((time.monotonic(), getattr(message, "twist", message).linear.x))

        bus.create_node(f"wheels_{len(self.speeds)}").create_subscription(kind, topic, on, 10)

    def moves(self, topic: str, since_s: float = 0.0) -> bool:
        """Whether somebody has commanded a speed."""
        return any(speed for at_s, speed in self.speeds[topic] if at_s >= since_s)

    def stopped_after_s(self, topic: str) -> float:
        """How long after the last command to move the zero came."""
        said = self.speeds[topic]
        last = max(i for i, (_, speed) in enumerate(said[:-1]) if speed and not said[i + 1][1])
        return said[last + 1][0] - said[last][0]


@contextmanager
def held(page: Any, key: str = "w") -> Iterator[None]:
    page.keyboard.down(key)
    try:
        yield
    finally:
        page.keyboard.up(key)


@contextmanager
def others(address: str) -> Iterator[Callable[..., None]]:
    """Another client, named Lin."""
    with connect(address.replace("http://", "ws://").rstrip("/"), max_size=None) as client:

        def ask(command: str) -> None:
            _send(
                client, op="call_service", service="/twin/control", args={"command": command, "name": "Lin"}
            )
            client.recv(timeout=60.0)

        yield ask


def _send(client: ClientConnection, **message: Any) -> None:
    client.send(json.dumps(message))


def test_a_stopped_robot_is_not_driven_past_its_guard() -> None:
    heard = Heard()

    def guarded(bus: Bus, robot: Robot) -> None:
        heard.listen(bus, "/cmd_vel", TwistStamped)
        heard.listen(bus, "/guard/teleop", TwistStamped)
        GuardNode(bus, Graph.watch(bus), GateConfig())

    with hall(more=guarded) as (address, _), opened(address) as page:
        page.wait_for_selector(".banner")
        page.wait_for_selector(".stick")
        with held(page):
            eventually(lambda: heard.moves("/guard/teleop"), "the guard is asked")
            page.wait_for_timeout(500)
        assert not heard.moves("/cmd_vel"), "and holds the robot"
        page.click("#release")
        page.click("#release-confirm")
        page.wait_for_selector("#stop:enabled")
        with held(page):
            eventually(lambda: heard.moves("/cmd_vel"), "released, it moves")


def test_two_robots_one_falls_silent_and_the_other_is_driven_until_the_page_hangs() -> None:
    heard, made, simulation = Heard(), [], []

    def two(bus: Bus, robot: Robot) -> None:
        made.extend((robot, Robot(bus, [[0] * 9] * 9, Pose2(2.0, 1.0, 0.0), "blue")))
        kind = types.get("twin_msgs/msg/Simulation")
        publisher = robot.node.create_publisher(kind, "/simulation/state", LATCHED)
        state = types.get("simulation_interfaces/msg/SimulationState")
        simulation.append(lambda now: publisher.publish(kind(state=state(state=now), speed=1.0, resets=0)))
        simulation[0](1)
        heard.listen(bus, "/cmd_vel")
        heard.listen(bus, "/blue/cmd_vel")

    with hall(more=two) as (address, _), opened("about:blank", ready=False) as page:
        page.add_init_script(SOCKETS)
        page.goto(address)
        robots = page.locator("header select")
        eventually(lambda: robots.locator("option").count() == 2, "two robots")
        page.wait_for_selector(".stick")

        # Time that stands is no silence.
        simulation[0](2)
        page.wait_for_selector(".lamp:has-text('Paused')")
        made[0].speaks = False
        page.wait_for_timeout(3000)
        assert page.locator("#robot-silent").count() == 0
        simulation[0](1)
        page.wait_for_selector(".lamp:has-text('robot: silent for')")
        page.wait_for_selector("#robot-silent")
        assert page.locator("aside .grid.stale").count() == 1

        # It is an alarm, in both languages; known, it is counted no more.
        page.click("#tab-alarms")
        page.wait_for_selector("#alarm-list li:has-text('robot: silent since')")
        assert page.inner_text("#tab-alarms .count") == "1"
        for _theme in range(2):
            assert violations(page) == []
            page.click("#theme")
        page.click("#language")
        page.wait_for_selector("#alarm-list li:has-text('无消息')")
        page.click("#alarm-list button")
        page.wait_for_selector("#alarm-list li.known")
        assert page.locator("#tab-alarms .count").count() == 0

        # The other one speaks, and is driven, in Chinese.
        robots.select_option("/blue")
        page.locator("canvas.map").focus()
        page.wait_for_selector("#robot-silent", state="detached")
        page.click("#tab-drive")
        page.wait_for_selector("text=按住摇杆")
        with held(page):
            eventually(lambda: heard.moves("/blue/cmd_vel"), "it drives")
            page.evaluate(HANG)  # connected, and silent
            assert heard.stopped_after_s("/blue/cmd_vel") < STOPPED_S
        assert not heard.moves("/cmd_vel"), "the one that was not chosen stands"

        made[0].speaks = True
        page.click("#tab-alarms")
        page.wait_for_selector("#alarm-list li:has-text('已结束')")
        page.wait_for_selector(".lamp:has-text('已连接')")

        # A page that has lost its connection drives no more, with a key that is held or without.
        page.click("#tab-drive")
        began_s = time.monotonic()
        with held(page):
            eventually(lambda: heard.moves("/blue/cmd_vel", began_s), "it drives again")
            page.evaluate("sockets.forEach(socket => socket.close())")
            page.wait_for_selector(".lamp:has-text('连接中断')")
            page.wait_for_selector(".lamp:has-text('已连接')")
            page.wait_for_timeout(500)
            assert heard.speeds["/blue/cmd_vel"][-1][1] == 0.0
            assert heard.stopped_after_s("/blue/cmd_vel") < STOPPED_S


def test_control_is_kept_while_it_is_wanted_and_a_refusal_is_told_once() -> None:
    heard, estimates = Heard(), []

    def drive(bus: Bus, robot: Robot) -> None:
        heard.listen(bus, "/cmd_vel")
        robot.node.create_subscription(PoseWithCovarianceStamped, "initialpose", estimates.append, 10)

    with hall(more=drive) as (address, _), opened(address) as page, others(address) as lin:
        control = page.locator("header .control")
        control.locator("text=Take control").click()
        control.locator("text=You have control").wait_for()
        page.wait_for_timeout(5000)
        assert "You have control" in control.inner_text(), "longer than it lasts by itself"
        page.evaluate(HIDE, True)
        control.locator("text=Nobody has control").wait_for()
        assert "Control is over" in page.inner_text(".notice")
        page.evaluate(HIDE, False)
        page.wait_for_timeout(1500)
        assert "Nobody has control" in control.inner_text(), "who had slept asks again"
        control.locator("text=Take control").click()
        control.locator("text=You have control").wait_for()

        lin("take_over")
        page.wait_for_selector(".notice:has-text('Lin has taken control over')")
        page.wait_for_selector(".stick")
        page.evaluate(COUNT_ALERTS)
        began_s = time.monotonic()
        with held(page):
            for _ in range(4):
                lin("take")
                page.wait_for_timeout(500)
        assert not heard.moves("/cmd_vel", began_s)
        assert page.inner_text(".notice span") == "Lin has control: take over first"
        assert page.evaluate("alerts") <= 1
        page.click("#tool-pose")
        page.locator("canvas.map").click(position={"x": 500, "y": 400})
        page.click("#tab-log")
        page.wait_for_selector("ol.log li:has-text('refused: 2D pose estimate')")
        lines = page.locator("ol.log li").all_inner_texts()
        assert sum("has control" in line for line in lines) <= 4, lines
        assert not any("page 2D pose" in line for line in lines)
        assert estimates == []
        for _theme in range(2):
            page.wait_for_selector(".notice")
            assert violations(page) == []
            page.click("#theme")

        # Once it is taken over, the same is done.
        lin("release")
        page.click("#tool-pose")
        page.locator("canvas.map").click(position={"x": 500, "y": 400})
        page.wait_for_selector("ol.log li:has-text('page 2D pose estimate')")
        eventually(lambda: len(estimates) == 1, "the robot is told")


def test_who_has_a_token_comes_in_by_its_role_and_name() -> None:
    heard = Heard()

    def guarded(bus: Bus, robot: Robot) -> None:
        heard.listen(bus, "/cmd_vel", TwistStamped)
        GuardNode(bus, Graph.watch(bus), GateConfig())

    with hall(more=guarded, tokens=TOKENS) as (address, server), opened(address, ready=False) as page:
        page.wait_for_selector("#token-form")
        assert page.locator("#token-form [role=alert]").count() == 0
        assert violations(page) == []
        page.fill("#token-form input", "a wrong one, 12345")
        page.keyboard.press("Enter")
        page.wait_for_selector("#token-form [role=alert]")
        page.wait_for_timeout(5000)
        wrong = max(count for count, _ in server.server._door._wrong.values())
        assert wrong <= 4, "the address is not locked out by a page that asks again and again"

        # The right one is told at once. Who has entered no name goes by the token's.
        page.fill("#token-form input", SECRETS["operator"])
        page.keyboard.press("Enter")
        page.wait_for_selector("#release")
        page.click("#release")
        page.click("#release-confirm")
        page.wait_for_selector("#stop:enabled")
        page.locator("header .control").get_by_text("Take control").click()
        eventually(lambda: _holder(server).startswith("the operator"), "the token's name")
        page.click("header .control button[aria-label='Your name']")
        page.fill("#name-form input", "Mei")
        assert violations(page) == []
        page.keyboard.press("Enter")
        eventually(lambda: _holder(server).startswith("Mei (the operator"), "the name that was entered")
        page.locator("header .control").get_by_text("Give back").click()
        page.reload()
        page.wait_for_selector("aside .grid")  # the token is kept
        page.locator("header .control").get_by_text("Take control").click()
        eventually(lambda: _holder(server).startswith("Mei (the operator"), "the name is kept")
        page.click("#stop")
        page.wait_for_selector(".banner:has-text('Mei')")
        page.click("#release")
        page.click("#release-confirm")
        page.wait_for_selector("#stop:enabled")

        # A viewer sees no tools; a stop that is refused ends, and is told.
        page.goto(f"{address}?token={SECRETS['viewer']}")
        page.wait_for_selector("header .control:has-text('You watch')")
        for tool in ("#tool-goal", "#tool-pose", "#tool-zone", "#tab-drive", "text=Take control"):
            assert page.locator(tool).count() == 0, tool
        page.click("#stop")
        page.wait_for_selector("[role=alert]:has-text('Your role may not do that (viewer)')")
        page.wait_for_selector("#stop:disabled:has-text('STOP')")
        page.click("#tab-log")
        page.wait_for_timeout(1000)
        assert page.locator("ol.log li:has-text('not for the role viewer')").count() == 1
        assert violations(page) == []
        page.set_viewport_size({"width": 360, "height": 740})
        assert page.evaluate("document.documentElement.scrollWidth") <= 360


def _holder(server: Any) -> str:
    return str(server.bridge.control.state()["holder"])
