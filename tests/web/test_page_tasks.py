"""A robot's tasks and a simulation's time, in a browser."""

from __future__ import annotations

from typing import Any

import pytest

from tests.runtime.test_lost_tote import HALL
from tests.web.test_page import address, eventually, page, violations
from tests.web.test_page import pytestmark as browser

__all__ = ["HALL", "address", "page"]
pytestmark = [*browser, pytest.mark.timeout(900)]

SCENARIO = """
name: operator
description: A robot waits for tasks.
seed: 1
duration: 60 min
world: {arena: hall.yaml}
robots:
  - {model: warehouse_bot, start: start, localisation: {type: amcl}, navigation: {}}
mission: {type: tasks, robot: warehouse_bot}
checks: [no_collision: ]
"""


@pytest.fixture(autouse=True)
def tasks(page: Any) -> None:
    """Show the panel of tasks, beside a map that costs little, with nothing left to do."""
    page.set_viewport_size({"width": 920, "height": 700})
    page.click("#tab-tasks")
    page.wait_for_selector("#add-task")
    if page.locator("#clear-tasks").count():
        page.click("#clear-tasks")
        page.wait_for_selector("#clear-tasks", state="detached")
    if page.locator("#resume-tasks").count():
        page.click("#resume-tasks")
    page.wait_for_selector("#pause-tasks")


def add(page: Any, kind: str, **fields: str) -> None:
    """Fill the form, and send it."""
    page.select_option("#add-task [name=type]", kind)
    for name, value in fields.items():
        field = page.wait_for_selector(f"#add-task [name={name}]")
        if field.evaluate("element => element.tagName") == "SELECT":
            field.select_option(value)
        else:
            field.fill(value)
    page.click("#add-task button")


def waiting(page: Any) -> list[str]:
    """The tasks that wait, in their order."""
    return page.locator("#queue li[data-state=waiting] b").all_inner_texts()


def said(page: Any, words: str) -> None:
    """Wait for a sentence of the robot's."""
    eventually(lambda: words in page.inner_text("#said"), words)


def held(page: Any, *, paused: bool) -> None:
    page.wait_for_selector("#simulation-step:enabled" if paused else "#simulation-step:disabled")


def test_tasks_are_added_refused_reordered_and_cancelled(page: Any) -> None:
    # A queue that is held takes tasks, and begins none.
    page.click("#pause-tasks")
    page.wait_for_selector("#held")
    add(page, "wait", seconds="2")
    eventually(lambda: waiting(page) == ["Wait 2 s"], "what is typed is what is added")
    add(page, "drive_to", place="", x="-1", y="-1", heading="0")
    eventually(lambda: len(waiting(page)) == 2, "a typed pose")
    add(page, "carry", tote="tote", to="unloading/0/0")
    eventually(lambda: waiting(page)[2:] == ["Carry tote → unloading/0/0"], "a tote")

    # What cannot be done is refused, in a sentence that says what can.
    add(page, "drive_to", place="", x="0", y="1.7", heading="90")
    said(page, "(0.00, 1.70) is in a wall, or cannot be reached; the nearest place that can is (")
    assert len(waiting(page)) == 3

    # By keyboard alone the tote is put first, and stays in hand: then it is taken out.
    last = page.locator("#queue li[data-state=waiting]").nth(2).get_attribute("data-id")
    for place in (1, 0):
        page.focus(f"#earlier-{last}")
        page.keyboard.press("Enter")
        eventually(lambda at=place: waiting(page)[at].startswith("Carry"), "it goes up")
        eventually(lambda: page.evaluate("document.activeElement.id.split('-')[1]") == last, "its focus")
    page.locator("#queue li[data-state=waiting] button[aria-label^=Cancel]").first.click()
    eventually(lambda: len(waiting(page)) == 2, "it is cancelled")
    page.wait_for_selector("#queue li[data-state=canceled]")


def test_what_waits_is_done_unless_somebody_holds_time_or_stops_the_robot(page: Any) -> None:
    page.click("#pause-tasks")
    page.wait_for_selector("#held")
    add(page, "wait", seconds="2")
    add(page, "carry", tote="tote", to="unloading")
    eventually(lambda: len(waiting(page)) == 2, "a queue that is held begins nothing")

    # Time stands while it is held, and the page is answered.
    page.click("#simulation-play")
    held(page, paused=True)
    eventually(lambda: page.inner_text(".lamp") == "Paused", "the page says so")
    add(page, "drive_to", place="start")
    eventually(lambda: waiting(page)[2:] == ["Drive to start"], "it is answered while time stands")
    page.click("#simulation-play")
    held(page, paused=False)

    # What waits is done when the queue goes on.
    page.click("#resume-tasks")
    page.wait_for_selector("#queue li[data-state=succeeded]:has-text('Wait')")
    page.wait_for_selector("#queue li[data-state=active]:has-text('Carry')")

    # The emergency stop ends what is under way, and holds the queue past its release.
    page.click("#stop")
    page.wait_for_selector("#held:has-text('emergency stop')")
    page.wait_for_selector("#queue li[data-state=canceled]:has-text('emergency stop')")
    page.click("#resume-tasks")
    said(page, "release it first")
    page.click("#release")
    page.click("#release-confirm")
    page.wait_for_selector("#stop:enabled")
    page.click("#resume-tasks")
    page.wait_for_selector("#queue li[data-state=succeeded]:has-text('Drive to start')")


def test_a_reset_begins_anew_and_the_page_goes_on(page: Any) -> None:
    add(page, "wait", seconds="1")
    page.wait_for_selector("#queue li[data-state=succeeded]")
    page.select_option("#simulation-speed", "5")
    page.click("#simulation-reset")
    page.click("#reset-confirm")
    eventually(lambda: page.locator("#queue li").count() == 0, "the queue is as it was at the start")
    eventually(lambda: page.input_value("#simulation-speed") == "5", "the speed stays")
    add(page, "wait", seconds="1")
    page.wait_for_selector("#queue li[data-state=succeeded]")


def test_tasks_are_in_the_way_of_nobody(page: Any) -> None:
    page.click("#pause-tasks")
    page.wait_for_selector("#held")
    for seconds in ("1", "2"):
        add(page, "wait", seconds=seconds)
    eventually(lambda: len(waiting(page)) == 2, "two tasks")
    for _language in range(2):
        for _theme in range(2):
            assert violations(page) == []
            page.click("#theme")
        page.click("#simulation-reset")
        assert violations(page) == [], "the question before a reset"
        page.keyboard.press("Escape")
        page.click("#language")
    page.set_viewport_size({"width": 360, "height": 740})
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    assert violations(page) == []
