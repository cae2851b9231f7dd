"""Plugin of pytest: writes down which test reaches which lines, how long each takes, and which pass."""

from __future__ import annotations

import json
import os
from collections.abc import Generator
from pathlib import Path

import coverage
import pytest

_seconds: dict[str, float] = {}
_bad: set[str] = set()


def _function(item: str) -> str:
    """Return a test without its parameters: one context for all of them."""
    return item.partition("[")[0]


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, None, None]:
    measured = coverage.Coverage.current()
    assert measured is not None
    measured.switch_context(_function(item.nodeid))
    yield
    measured.switch_context("")


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    name = _function(report.nodeid)
    _seconds[name] = _seconds.get(name, 0.0) + report.duration
    if report.failed:
        _bad.add(name)


def pytest_sessionfinish() -> None:
    passed = {name: spent for name, spent in _seconds.items() if name not in _bad}
    Path(os.environ["TWIN_TEST_SECONDS"]).write_text(json.dumps(passed), "utf-8")
