"""How a robot is mirrored now, as others hear it on `/diagnostics`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

from twin.bridge.msgs import DiagnosticArray, DiagnosticStatus, KeyValue, header
from twin.geometry import Pose2
from twin.live.mirror.label import LABELS, Evidence, Judgement, Label

_NAME = "twin: "
_LEVELS: dict[Label, int] = {"twin": 0, "shadow": 1, "model": 2}
"""OK, WARN, ERROR of diagnostic_msgs."""
_TOLD = "told "
_DELAY = ("delay_s", "jitter_s")
_NUMBERS = ("age_s", "position", "yaw", "clock_bound_s")


@dataclass(frozen=True, kw_only=True)
class Status:
    """Of one robot, at one time."""

    robot: str
    judgement: Judgement
    evidence: Evidence
    virtual: Pose2
    """In the map."""
    physical: Pose2 | None
    """Likewise, where it was seen last."""
    clock_offset_s: float | None
    """The robot's clock minus this computer's [s]."""
    delay_s: tuple[float, float] | None = None
    """How late data of the robot come, and how far nine of ten are from that, by its clock [s]."""
    told: Mapping[str, str] = field(default_factory=dict)
    """What the robot tells of itself: `mission`, `battery`."""
    resets: int
    """How often the virtual robot was put elsewhere at once."""
    alarms: tuple[str, ...] = ()
    """What is not as it should be now, in sentences."""

    def to_message(self) -> DiagnosticStatus:
        """Return it with everything in words; numbers in SI units."""
        evidence, label = self.evidence, self.judgement.label
        values = {name: getattr(evidence, name) for name in _NUMBERS}
        values |= {f"virtual_{name}": value for name, value in self.virtual._asdict().items()}
        if self.physical is not None:
            values |= {f"physical_{name}": value for name, value in self.physical._asdict().items()}
        values |= {"clock_offset_s": self.clock_offset_s, "resets": self.resets}
        values |= dict(zip(_DELAY, self.delay_s or (None, None), strict=True))
        entries = [
            KeyValue(key=key, value="" if value is None else f"{value:.6g}") for key, value in values.items()
        ]
        entries.append(KeyValue(key="acknowledged", value=str(evidence.acknowledged).lower()))
        entries.append(KeyValue(key="commands", value=evidence.commands))
        entries += [KeyValue(key=f"{_TOLD}{key}", value=value) for key, value in self.told.items()]
        entries += [KeyValue(key="alarm", value=alarm) for alarm in self.alarms]
        why = "; ".join(self.judgement.why)
        return DiagnosticStatus(
            level=_LEVELS[label],
            name=f"{_NAME}{self.robot}",
            message=f"{label}: {why}" if why else label,
            hardware_id=self.robot,
            values=entries,
        )

    @classmethod
    def from_message(cls, message: DiagnosticStatus) -> Self | None:
        """Return what a mirror has told; None for what is of something else, or incomplete."""
        label, _, why = message.message.partition(": ")
        if not message.name.startswith(_NAME) or label not in LABELS:
            return None
        told = {entry.key: entry.value for entry in message.values}
        alarms = tuple(entry.value for entry in message.values if entry.key == "alarm")
        numbers = {key: _number(value) for key, value in told.items()}
        delay, jitter = (numbers.get(name) for name in _DELAY)
        virtual = [numbers.get(f"virtual_{name}") for name in Pose2._fields]
        physical = [numbers.get(f"physical_{name}") for name in Pose2._fields]
        return cls(
            robot=message.hardware_id,
            judgement=Judgement(label=label, why=tuple(why.split("; ")) if why else ()),
            evidence=Evidence(
                age_s=numbers.get("age_s"),
                position=numbers.get("position"),
                yaw=numbers.get("yaw"),
                clock_bound_s=numbers.get("clock_bound_s"),
                acknowledged=told.get("acknowledged") == "true",
                commands=told.get("commands", ""),
            ),
            virtual=Pose2(*(math.nan if value is None else value for value in virtual)),
            physical=None if None in physical else Pose2(*(value or 0.0 for value in physical)),
            clock_offset_s=numbers.get("clock_offset_s"),
            delay_s=None if delay is None or jitter is None else (delay, jitter),
            told={key.removeprefix(_TOLD): value for key, value in told.items() if key.startswith(_TOLD)},
            resets=int(numbers.get("resets") or 0),
            alarms=alarms,
        )


def to_array(statuses: Sequence[Status], time_ns: int) -> DiagnosticArray:
    """Return the statuses of all robots as one message."""
    return DiagnosticArray(header=header(time_ns, ""), status=[status.to_message() for status in statuses])


def worst(statuses: Sequence[Status]) -> Label:
    """Return the least of the labels."""
    return min((status.judgement.label for status in statuses), key=LABELS.index)


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
