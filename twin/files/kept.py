"""What was computed at some cost and may be needed again, in the user's cache folder.

Each value is one file, written whole. One that is missing or broken is as if it had never been there: whoever
asks computes it anew, and knows by its key and its content whether it still holds.
"""

from __future__ import annotations

import hashlib
import json
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

from twin.files.writing import replaced

VARIABLE = "TWIN_CACHE"
"""Environment variable: the folder, instead of `twin` in the user's own; `off` keeps nothing."""
MOST = 200
"""Values of a kind; the oldest goes first."""


def kept(kind: str, key: str) -> Any:
    """Return the value that was kept under a key, or None."""
    file = _file(kind, key)
    if file is not None:
        with suppress(OSError, ValueError, RecursionError):
            return json.loads(file.read_bytes())
    return None


def keep(kind: str, key: str, value: Any) -> None:
    """Keep a value, of which JSON can be made, if that is possible."""
    file = _file(kind, key)
    if file is None:
        return
    with suppress(OSError):
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with replaced(file) as new:
            new.write_text(json.dumps(value), "utf-8")
        for old in sorted(file.parent.iterdir(), key=lambda one: -one.stat().st_mtime_ns)[MOST:]:
            old.unlink()


def hash_of(path: str | Path) -> str | None:
    """Return the SHA-256 of a file's content; None: it cannot be read."""
    try:
        with open(path, "rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError:
        return None


def _file(kind: str, key: str) -> Path | None:
    given = os.environ.get(VARIABLE)
    if given == "off":
        return None
    try:
        own = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "twin"
    except RuntimeError:  # nobody's home
        return None
    name = hashlib.sha256(key.encode(errors="surrogateescape")).hexdigest()
    return (Path(given) if given else own) / kind / f"{name}.json"
