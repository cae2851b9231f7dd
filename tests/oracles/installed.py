"""What of others' data is installed here."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path


def example_robots() -> list[Path]:
    """Return the files, in order of their path; none if example-robot-data is not installed."""
    try:
        files = importlib.metadata.files("example-robot-data") or []
    except importlib.metadata.PackageNotFoundError:
        return []
    return sorted(Path(str(file.locate())) for file in files if file.suffix == ".urdf")
