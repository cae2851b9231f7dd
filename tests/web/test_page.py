"""The operator's page in a browser, on a run that others can join."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.processes import free_endpoint

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
CHROMIUM = Path("/usr/bin/chromium")
AXE = Path(__file__).parent / "axe/axe.min.js"
PATIENCE_S = 120
SCENARIO = """
name: operator
description: A robot waits for an operator.
seed: 1
duration: 60 min
world: {arena: warehouse}
robots:
  - model: warehouse_bot
    start: start
    localisation: {type: amcl, map: warehouse}
    navigation: {}
checks:
  - no_collision:
"""

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no browser at {CHROMIUM}"),
]


def eventually(holds: Callable[[], bool], what: str) -> None:
    """Wait until something holds, generously: the machine may be busy."""
    until = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < until, what
        time.sleep(0.1)


@pytest.fixture(scope="module")
def address(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Where a page is served, beside a run of the module's `SCENARIO`, in its `HALL` if it has one."""
    folder = tmp_path_factory.mktemp("page")
    (folder / "operator.yaml").write_text(request.module.SCENARIO)
    (folder / "hall.yaml").write_text(getattr(request.module, "HALL", ""))
    endpoint, port = free_endpoint(), free_endpoint().rpartition(":")[2]
    twin = [sys.executable, "-m", "twin.cli"]
    run = [*twin, "run", "operator.yaml", "--free", "--pace", "1", "--listen", endpoint, "--no-record"]
    bridge = [*twin, "rosbridge", "--connect", endpoint, "--port", port, "--use-sim-time"]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    children = []
    try:
        for command in (run, bridge):
            children.append(subprocess.Popen(command, cwd=folder, env=environment))
            until = time.monotonic() + PATIENCE_S
            where = int((endpoint.rpartition(":")[2], port)[len(children) - 1])
            while not _answers(where):
                assert time.monotonic() < until, f"{command} does not listen"
                assert children[-1].poll() is None, f"{command} ended"
                time.sleep(0.2)
        yield f"http://127.0.0.1:{port}/"
    finally:
        for child in reversed(children):
            child.send_signal(signal.SIGINT)
            try:
                child.wait(20)
            except subprocess.TimeoutExpired:
                child.kill()
                child.wait()


def _answers(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


@pytest.fixture
def page(address: str) -> Iterator[Any]:
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1440, "height": 900}, color_scheme="dark", locale="en-GB")
        page.set_default_timeout(PATIENCE_S * 1000)
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        page.goto(address)
        eventually(
            lambda: speed(page) is not None and position(page) != (0, 0), "the robot tells where it is"
        )
        yield page
        browser.close()
        assert all(url.startswith((address, "data:", "blob:")) for url in asked), "it asks nobody else"


def figure(page: Any, number: int) -> str:
    return page.inner_text(f"aside .grid div:nth-child({number}) dd")


def speed(page: Any) -> float | None:
    return abs(float(figure(page, 1).split()[0])) if page.locator("aside .grid").count() else None


def position(page: Any) -> tuple[float, float]:
    x, y = figure(page, 3).split(" m")[0].split(", ")
    return float(x), float(y)


def violations(page: Any) -> list[str]:
    page.evaluate(AXE.read_text("utf-8"))
    return page.evaluate("axe.run().then(({violations}) => violations.map(({id}) => id))")


def test_an_operator_drives_sends_stops_and_releases(page: Any) -> None:
    # Held, it drives; let go, it stands.
    stick = page.locator(".stick")
    box = stick.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 20)
    eventually(lambda: speed(page) > 0.1, "it drives while the stick is held")
    page.mouse.up()
    eventually(lambda: speed(page) == 0, "it stands when the stick is let go")

    # The stop is latched: it survives a reload, and only a confirmed release ends it.
    page.click("#stop")
    page.wait_for_selector("#release")
    page.reload()
    page.click("#release")
    assert page.locator("#release").count() == 1
    page.click("#release-confirm")
    page.wait_for_selector("#stop:enabled")

    # A click on the map is a goal; the robot gets there.
    page.click("#tab-tasks")
    page.click("#tool-goal")
    before = position(page)
    page.locator("canvas.map").click(position={"x": 250, "y": 640})
    page.wait_for_selector("#queue li[data-state=succeeded]")
    assert position(page)[0] > before[0] + 0.5

    # A click is a pose estimate: the robot believes it.
    page.click("#tool-pose")
    page.locator("canvas.map").click(position={"x": 500, "y": 400})
    eventually(lambda: position(page)[1] > -3, "the robot believes what it is told about its pose")


def test_nothing_is_in_the_way_of_anybody(page: Any) -> None:
    for _language in range(2):
        for _theme in range(2):
            for panel in ("drive", "tasks", "alarms", "log", "plot", "camera"):
                page.click(f"#tab-{panel}")
                assert violations(page) == [], panel
            page.click("#theme")
        page.click("#language")
    page.set_viewport_size({"width": 360, "height": 740})
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
