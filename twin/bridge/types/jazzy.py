"""The definitions of ROS Jazzy's messages that rosbags has, as a table: its own module makes a class of each.

`python docs/reference.py` writes it, after a change of rosbags.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from twin.bridge.types.type_hash import FieldDefs

TABLE = Path(__file__).with_name("jazzy.json")


def jazzy() -> FieldDefs:
    """Return constants and fields by package/msg/Name, in rosbags' form."""
    found: dict[str, Any] = json.loads(TABLE.read_text("utf-8"))
    return {
        name: ([tuple(one) for one in constants], [_tuples(field) for field in fields])
        for name, (constants, fields) in found.items()
    }


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value
