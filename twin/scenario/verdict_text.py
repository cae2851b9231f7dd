"""A verdict as plain text, for a log without colours."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from twin.scenario.quantities import quantity


def lines_of(verdict: Mapping[str, Any]) -> Iterator[str]:
    """Yield why checks do not hold, then the table of all."""
    checks = verdict["checks"]
    for check in checks:
        if not check["passed"]:
            yield f"{check['name']}: {check['reason']}"
    numbers = ["value", "limit", *(["margin"] if any(c.get("margin") is not None for c in checks) else [])]
    rows = [["", "check", *numbers, "at"]]
    for check in checks:
        shown = [
            "" if check.get(key) is None else quantity(check[key], check["unit"], check["limit"])
            for key in numbers
        ]
        at = check["at_s"] if check.get("worst_s") is None else check["worst_s"]
        rows.append(
            ["ok" if check["passed"] else "FAIL", check["name"], *shown, "" if at is None else f"{at:.2f} s"]
        )
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        padded = [
            text.rjust(width) if i > 1 else text.ljust(width)
            for i, (text, width) in enumerate(zip(row, widths, strict=True))
        ]
        yield "  ".join(padded).rstrip()
