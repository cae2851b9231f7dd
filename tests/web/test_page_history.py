"""The page on a bag in a browser: as it was, at any time."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.processes import free_endpoint
from tests.web import some_bag
from tests.web.hall import opened
from tests.web.test_page import CHROMIUM, eventually, figure, position, violations

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no browser at {CHROMIUM}"),
]


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder = tmp_path_factory.mktemp("past")
    some_bag.write(folder / "drive")
    port = free_endpoint().rpartition(":")[2]
    command = [sys.executable, "-m", "twin.cli", "rosbridge", "--bag", "drive", "--port", port]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    with subprocess.Popen(command, cwd=folder, env=environment) as process:

        def answers() -> bool:
            assert process.poll() is None
            with socket.socket() as probe:
                return probe.connect_ex(("127.0.0.1", int(port))) == 0

        eventually(answers, "it listens")
        yield f"http://127.0.0.1:{port}/"
        process.send_signal(signal.SIGINT)
    assert process.returncode == 0
    audit = (folder / "runs/rosbridge.jsonl").read_text("utf-8").splitlines()
    targets = {json.loads(line)["target"].rpartition("/")[0] for line in audit}
    assert targets == {"/rosbag2_player"}, "nobody commanded a robot"


GOODS = """() => {
    const canvas = document.querySelector('canvas.map'), { width, height } = canvas, at = [];
    const image = canvas.getContext('2d').getImageData(0, 0, width, height);
    const pixels = new Uint32Array(image.data.buffer);
    pixels.forEach((pixel, i) => pixel === 0xff51c4f5 && at.push([i % width, Math.floor(i / width)]));
    const mean = (axis) => Math.round(at.reduce((sum, each) => sum + each[axis], 0) / at.length);
    return at.length && [mean(0), mean(1)];
}"""
"""Where the map shows goods [pixels], 0 where it does not."""


def slide(page: Any, seconds: float) -> None:
    script = (
        "(slider, to) => { slider.value = to; slider.dispatchEvent(new Event('input', {bubbles: true})) }"
    )
    page.locator("#time").evaluate(script, seconds)
    shown = f"{int(seconds // 60)}:{seconds % 60:04.1f}"
    eventually(lambda: page.inner_text("#past-now").startswith(shown), f"it stands at {shown}")


def test_the_page_shows_a_bag_as_it_was_and_commands_nothing(address: str) -> None:
    with opened(address) as page:
        page.wait_for_selector("text=History")
        eventually(lambda: position(page)[0] > 0.05, "it plays")
        page.click("#play[aria-label=Pause]")
        page.wait_for_selector("#play[aria-label=Play]")
        for control in ("#stop", "#tool-goal", "#tool-zone", "#tab-drive", "#tab-tasks", "text=Take control"):
            assert page.locator(control).count() == 0, control

        slide(page, 52.0)
        eventually(lambda: position(page) == (5.2, 1.5), "the robot is where it was, in the map")
        page.click("#tab-mission")
        assert page.inner_text("ol.steps").split("\n") == [*some_bag.MISSION.values()]
        page.click("#tab-log")
        assert "a wheel slips" in page.inner_text("ol.log")
        page.click("#tab-alarms")
        assert page.locator("li.alarm").count() == 1
        assert page.inner_text("li.alarm time") == "0:50", "when it was said, not when it was heard"
        page.click("li.alarm button")
        page.reload()
        page.wait_for_selector("text=History")
        page.click("#tab-alarms")
        page.wait_for_selector("li.alarm.known")
        assert not page.evaluate(GOODS), "where the robot was when it saw them is not known"

        slide(page, 20.0)  # back
        eventually(lambda: position(page) == (2.0, 1.5), "the robot is where it was before")
        page.click("#tab-log")
        eventually(lambda: "a wheel slips" not in page.inner_text("ol.log"), "it is not said yet")
        assert "all is well" in page.inner_text("ol.log")
        page.click("#tab-mission")
        assert page.inner_text("ol.steps") == some_bag.MISSION[5]

        # By keys: a step is a tenth of a second.
        page.focus("#time")
        for _ in range(5):
            page.keyboard.press("ArrowRight")
        eventually(lambda: position(page)[0] == 2.05, "half a second on")
        page.select_option("#rate", "8")
        page.click("#play")
        eventually(lambda: position(page)[0] > 3.0, "it goes on, fast")
        goods = page.evaluate(GOODS)
        assert goods
        eventually(lambda: position(page)[0] > 4.0, "it drives on")
        assert page.evaluate(GOODS) == goods, "what it saw stays where it was"
        assert re.match(r"\d:\d\d\.\d / 1:00\.0", page.inner_text("#past-now"))
        assert figure(page, 1) == "0.10 m/s"
        page.click("#play")

        # A bag that is paused plots what it said last; a switch of language leaves no word behind.
        page.click("#tab-plot")
        page.select_option(".plot >> xpath=../label[1]/select", "/odom")
        page.wait_for_selector("option[value='twist.twist.linear.x']", state="attached")
        page.select_option(".plot >> xpath=../label[2]/select", "twist.twist.linear.x")
        page.hover(".u-over")
        eventually(lambda: "0.1" in page.inner_text(".plot"), "the last value")
        # And what it was before.
        page.hover(".u-over", position={"x": 20, "y": 60})
        when, what = page.locator(".u-legend .u-value").all_inner_texts()
        assert 10.0 < float(when.replace(",", "")) < 30.0, "half a minute ago"
        assert what == "0.1"
        page.click("#language")
        eventually(lambda: "字段" in page.inner_text(".u-legend"), "the legend is in the page's language")
        page.click("#language")
        for _language in range(2):
            for _theme in range(2):
                assert violations(page) == []
                page.click("#theme")
            page.click("#language")
        page.set_viewport_size({"width": 360, "height": 740})
        assert page.evaluate("document.documentElement.scrollWidth") <= 360
