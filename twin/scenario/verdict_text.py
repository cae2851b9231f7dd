"""What a verdict says, as plain text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from twin.scenario.quantities import quantity, seconds


def reasons(verdict: Mapping[str, Any]) -> list[str]:
    """Return why a run did not pass: its error, or what each check says that does not hold."""
    if verdict["error"] is not None:
        return [str(verdict["error"])]
    return [f"{check['name']}: {check['reason']}" for check in verdict["checks"] if not check["passed"]]


def moment_of(check: Mapping[str, Any]) -> float | None:
    """Return when a check was nearest to its limit or, of one that has none, was decided [s]."""
    at: float | None = check["at_s"] if check.get("worst_s") is None else check["worst_s"]
    return at


def lines_of(verdict: Mapping[str, Any]) -> Iterator[str]:
    """Yield why checks do not hold, then the table of all."""
    checks = verdict["checks"]
    yield from reasons(verdict)
    numbers = ["value", "limit", *(["margin"] if any(c.get("margin") is not None for c in checks) else [])]
    rows = [["", "check", *numbers, "at"]]
    for check in checks:
        shown = [
            "" if check.get(key) is None else quantity(check[key], check["unit"], check["limit"])
            for key in numbers
        ]
        rows.append(
            ["ok" if check["passed"] else "FAIL", check["name"], *shown, seconds(moment_of(check), 2)]
        )
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        padded = [
            text.rjust(width) if i > 1 else text.ljust(width)
            for i, (text, width) in enumerate(zip(row, widths, strict=True))
        ]
        yield "  ".join(padded).rstrip()
