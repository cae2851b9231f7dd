"""A verdict as plain text, for a log without colours."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from twin.scenario.quantities import quantity


def lines_of(verdict: Mapping[str, Any]) -> Iterator[str]:
    """Yield why checks do not hold, then the table of all."""
    for check in verdict["checks"]:
        if not check["passed"]:
            yield f"{check['name']}: {check['reason']}"
    rows = [("", "check", "value", "limit", "at")]
    for check in verdict["checks"]:
        value, limit = (quantity(check[key], check["unit"], check["limit"]) for key in ("value", "limit"))
        at = "" if check["at_s"] is None else f"{check['at_s']:.2f} s"
        rows.append(("ok" if check["passed"] else "FAIL", check["name"], value, limit, at))
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    for row in rows:
        left = [text.ljust(width) for text, width in zip(row[:2], widths[:2], strict=True)]
        right = [text.rjust(width) for text, width in zip(row[2:], widths[2:], strict=True)]
        yield "  ".join(left + right).rstrip()
