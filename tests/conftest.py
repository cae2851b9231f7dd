"""What tests start as processes is this checkout's code, wherever the package is installed."""

from __future__ import annotations

import atexit
import logging
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from tests.processes import free_endpoint

os.environ["PYTHONPATH"] = str(Path(__file__).parents[1])

# Where this is set, every process would compile every module, and pytest rewrite every test, anew.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

if "TWIN_CACHE" not in os.environ:  # the processes that tests start, and pytest-xdist's, have the same one
    os.environ["TWIN_CACHE"] = tempfile.mkdtemp(prefix="twin-cache-")
    atexit.register(shutil.rmtree, os.environ["TWIN_CACHE"], ignore_errors=True)

settings.register_profile("twin", deadline=None)  # a busy machine is no fault of an example
settings.load_profile("twin")


@pytest.fixture(autouse=True)
def _own_log() -> Iterator[None]:
    """Give the log back as it was: commands that run in this process show it from then on."""
    log = logging.getLogger("twin")
    level, handlers, propagate = log.level, log.handlers[:], log.propagate
    yield
    log.setLevel(level)
    log.handlers[:], log.propagate = handlers, propagate


@pytest.fixture
def endpoint() -> str:
    """Where nobody listens yet."""
    return free_endpoint()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run whole scenarios last; of long tests that first which may take longest: nobody waits for it."""

    def order(item: pytest.Item) -> tuple[bool, float]:
        may_take = item.get_closest_marker("timeout") if item.get_closest_marker("long") else None
        return item.get_closest_marker("slow") is not None, -may_take.args[0] if may_take else 0.0

    items.sort(key=order)
