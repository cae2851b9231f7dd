"""What a guard says, as diagnostics: every ROS 2 tool can show them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

from twin.bridge.msgs import DiagnosticArray, DiagnosticStatus, KeyValue, header, ns
from twin.nodes.guard.verdict import Verdict

_OK, _WARN, _ERROR = 0, 1, 2
_VERDICTS = frozenset(Verdict)


@dataclass(frozen=True, kw_only=True)
class GuardStatus:
    """The state of a guard."""

    stamp_ns: int
    """By its clock."""
    stopped_by: str | None
    """Who holds the robot stopped; None: it may move."""
    stops: int
    """How often it was stopped while it could move."""
    in_charge: str
    """Lane whose commands count; empty: nobody commands."""
    warnings: tuple[str, ...]
    """What is not as it should be, in sentences."""
    verdicts: Mapping[Verdict, int]
    """How many commands, by what became of them."""

    @property
    def is_stopped(self) -> bool:
        """Whether the robot may not move before a release."""
        return self.stopped_by is not None

    @property
    def words(self) -> str:
        """All of it but the counts, for people."""
        words = (
            f"stopped by {self.stopped_by}" if self.is_stopped else f"{self.in_charge or 'nobody'} commands"
        )
        return "; ".join((words, *self.warnings))

    def message(self) -> DiagnosticArray:
        """Return it for the wire."""
        level = _ERROR if self.is_stopped else _WARN if self.warnings else _OK
        values = {
            "stopped_by": self.stopped_by or "",
            "stops": str(self.stops),
            "in_charge": self.in_charge,
            **{f"warning {number}": text for number, text in enumerate(self.warnings, 1)},
            **{f"commands {verdict}": str(count) for verdict, count in sorted(self.verdicts.items())},
        }
        return _array(self.stamp_ns, "", "guard", level, self.words, values)

    @classmethod
    def of_message(cls, message: DiagnosticArray) -> Self | None:
        """Return what a message says; None: it is not a guard's."""
        values = _values(message, "guard")
        stops = values.get("stops", "")
        if not stops.isdecimal():
            return None
        counts = {verdict: values.get(f"commands {verdict}", "") for verdict in Verdict}
        return cls(
            stamp_ns=ns(message.header.stamp),
            stopped_by=values.get("stopped_by") or None,
            stops=int(stops),
            in_charge=values.get("in_charge", ""),
            warnings=tuple(text for key, text in values.items() if key.startswith("warning ")),
            verdicts={verdict: int(text) for verdict, text in counts.items() if text.isdecimal()},
        )


@dataclass(frozen=True, kw_only=True)
class Acknowledgement:
    """What became of one command, stop or release."""

    kind: str
    """Lane of a command; 'stop', 'release'."""
    stamp_ns: int
    """That of what is acknowledged."""
    by: str
    """Its frame: who sent it, for stops and releases."""
    verdict: Verdict
    seen_ns: int
    """When it arrived, by the clock of the guard's computer."""

    def message(self) -> DiagnosticArray:
        """Return it for the wire."""
        level = _OK if self.verdict is Verdict.ACCEPTED else _WARN
        values = {"seen": str(self.seen_ns)}
        return _array(self.stamp_ns, self.by, self.kind, level, self.verdict, values)

    @classmethod
    def of_message(cls, message: DiagnosticArray) -> Self | None:
        """Return what a message says; None: it is not a guard's."""
        if len(message.status) != 1:
            return None
        status, origin = message.status[0], message.header
        seen = _values(message, status.name).get("seen", "")
        if status.message not in _VERDICTS or not seen.isdecimal():
            return None
        return cls(
            kind=status.name,
            stamp_ns=ns(origin.stamp),
            by=origin.frame_id,
            verdict=Verdict(status.message),
            seen_ns=int(seen),
        )


def _array(
    stamp_ns: int, frame: str, name: str, level: int, text: str, values: Mapping[str, str]
) -> DiagnosticArray:
    pairs = [KeyValue(*pair) for pair in values.items()]
    return DiagnosticArray(header(stamp_ns, frame), [DiagnosticStatus(level, name, text, "", pairs)])


def _values(message: DiagnosticArray, name: str) -> dict[str, str]:
    return {pair.key: pair.value for each in message.status if each.name == name for pair in each.values}
