"""Plugin of pytest: writes down which test reaches which lines, what time each takes, and which pass."""

from __future__ import annotations

import json
import os
import time
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
    name, start = _function(item.nodeid), time.process_time()
    measured.switch_context(name)
    yield
    measured.switch_context("")
    _seconds[name] = _seconds.get(name, 0.0) + time.process_time() - start


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if report.failed:
        _bad.add(_function(report.nodeid))


def pytest_sessionfinish() -> None:
    passed = {name: spent for name, spent in _seconds.items() if name not in _bad}
    Path(os.environ["TWIN_TEST_SECONDS"]).write_text(json.dumps(passed), "utf-8")
