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


def numbers_of(check: Mapping[str, Any]) -> tuple[str, str, str, str]:
    """Return value, limit, margin and moment of a check as people read them; empty: it has no such."""
    value, limit = (quantity(check[key], check["unit"], check["limit"]) for key in ("value", "limit"))
    margin = check.get("margin")
    left = "" if margin is None else quantity(margin, check["unit"], check["limit"])
    return value, limit, left, seconds(moment_of(check), 2)


def lines_of(verdict: Mapping[str, Any]) -> Iterator[str]:
    """Yield why checks do not hold, then the table of all."""
    yield from reasons(verdict)
    rows: list[tuple[str, ...]] = [("", "check", "value", "limit", "margin", "at")]
    checks = verdict["checks"]
    rows += [("ok" if check["passed"] else "FAIL", check["name"], *numbers_of(check)) for check in checks]
    if not any(row[4] for row in rows[1:]):
        rows = [(*row[:4], row[5]) for row in rows]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        padded = [
            text.rjust(width) if i > 1 else text.ljust(width)
            for i, (text, width) in enumerate(zip(row, widths, strict=True))
        ]
        yield "  ".join(padded).rstrip()
