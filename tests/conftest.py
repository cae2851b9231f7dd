"""What tests start as processes is this checkout's code, wherever the package is installed."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.processes import free_endpoint

os.environ["PYTHONPATH"] = str(Path(__file__).parents[1])


@pytest.fixture
def endpoint() -> str:
    """Where nobody listens yet."""
    return free_endpoint()
