"""Files that a page of the documentation shows, below one of its headings."""

from __future__ import annotations

import re
from pathlib import Path

BLOCK = re.compile(
    r"^```\w+\n(?:# |<!-- )(?P<name>[\w./-]+\.\w+)(?: -->)?\n(?P<text>.*?)^```$", re.DOTALL | re.MULTILINE
)


def write_files(page: Path, heading: str, folder: Path) -> list[Path]:
    """Write a section's blocks that begin with the name of a file as a comment; return the scenarios."""
    section = re.split(rf"^### {re.escape(heading)}\n", page.read_text("utf-8"), flags=re.MULTILINE)[1]
    section = re.split(r"^##", section, maxsplit=1, flags=re.MULTILINE)[0]
    files = []
    for block in BLOCK.finditer(section):
        file = folder / block["name"]
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(block["text"], encoding="utf-8")
        files.append(file)
    return [file for file in files if file.suffix == ".yaml"]
