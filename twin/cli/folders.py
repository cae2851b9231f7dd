"""Where runs are written."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path


def run_folder(scenario: str) -> Path:
    """Create and return `runs/<scenario>/<YYYYmmdd-HHMMSS>`, with a counter if that second is taken."""
    name = datetime.now().strftime("%Y%m%d-%H%M%S")
    parent = Path("runs") / scenario
    parent.mkdir(parents=True, exist_ok=True)
    for suffix in ("", *(f"-{count}" for count in range(2, 1000))):
        folder = parent / (name + suffix)
        try:
            folder.mkdir()
        except FileExistsError:
            continue
        return folder
    raise FileExistsError(f"{parent / name}: a thousand runs were started in this second")
