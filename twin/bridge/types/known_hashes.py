"""The RIHS01 hashes of the types that come with this package: a table, so that a start computes none.

`python docs/reference.py` writes it, after a change of rosbags or of `interfaces/`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path

TABLE = Path(__file__).with_name("known_hashes.json")


@cache
def known_hashes() -> Mapping[str, str]:
    """Return the table: package/kind/Name of every type that an endpoint may have -> 'RIHS01_<64 hex>'."""
    found: dict[str, str] = json.loads(TABLE.read_text("utf-8"))["hashes"]
    return found
