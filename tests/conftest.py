"""What tests start as processes is this checkout's code, wherever the package is installed."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

from tests.processes import free_endpoint

os.environ["PYTHONPATH"] = str(Path(__file__).parents[1])

settings.register_profile("twin", deadline=None)  # a busy machine is no fault of an example
settings.load_profile("twin")


@pytest.fixture
def endpoint() -> str:
    """Where nobody listens yet."""
    return free_endpoint()
