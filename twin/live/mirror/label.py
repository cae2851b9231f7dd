"""What a virtual robot may call itself: `model`, `shadow` or `twin`, and why it is no more than that.

The words are those of Kritzinger et al., Digital Twin in manufacturing, 2018: data flow by hand is a model's,
automatic from the physical to the virtual one a shadow's, automatic both ways a twin's.
"""

from __future__ import annotations

from dataclasses import dataclass

from twin.scenario.verdict import Label as Label

LABELS: tuple[Label, ...] = ("model", "shadow", "twin")
"""Each asks for more than those before it."""


NOBODY = "nothing commands the robot from here"
"""Where the robot's own autonomy, or somebody else, does."""


@dataclass(frozen=True, kw_only=True)
class LabelConfig:
    """What each word asks for."""

    fresh_s: float = 0.4
    """A twin's latest data may be so old [s]."""
    lost_s: float = 5.0
    """A shadow's may be so old [s]."""
    position: float = 0.25
    """A twin is no farther from the physical robot than that [m]."""
    yaw: float = 0.35
    """It is not turned otherwise by more than that [rad]."""
    clock_s: float = 0.12
    """The robot's clock is known to a twin so well [s]."""


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What is known now."""

    age_s: float | None = None
    """Of the latest data on where the physical robot is [s]; None: there were none."""
    position: float | None = None
    """How far the two robots were apart when it was measured last [m]."""
    yaw: float | None = None
    """How far one was turned ahead of the other [rad]."""
    clock_bound_s: float | None = None
    """The robot's clock is known so well [s]; None: it is not."""
    clock: str = "the robot's clock is not known"
    """Why `clock_bound_s` is None, if it is."""
    acknowledged: bool = False
    """Whether what was last commanded from here was obeyed, as its acknowledgement or its motion tells."""
    commands: str = NOBODY
    """Why `acknowledged` is false, if it is."""
    doubts: tuple[str, ...] = ()
    """What else forbids the word `twin`: two robots with one name, numbers that are none, a rival."""


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """A label, and what it lacks to the next one."""

    label: Label
    why: tuple[str, ...]
    """Sentences; none for a twin."""


def judge(evidence: Evidence, config: LabelConfig = LabelConfig()) -> Judgement:
    """Return what the virtual robot is now."""
    age = evidence.age_s
    if age is None:
        return Judgement(label="model", why=("nothing was heard of a physical robot",))
    if age > config.lost_s:
        return Judgement(label="model", why=(f"nothing heard of the physical robot for {age:.0f} s",))
    why = []
    if age > config.fresh_s:
        why.append(f"the latest data are {age:.1f} s old")
    if evidence.position is not None and evidence.position > config.position:
        why.append(f"it is {evidence.position:.2f} m from the physical robot")
    if evidence.yaw is not None and abs(evidence.yaw) > config.yaw:
        why.append(f"it is turned {evidence.yaw:+.2f} rad from the physical robot")
    if evidence.clock_bound_s is None:
        why.append(evidence.clock)
    elif evidence.clock_bound_s > config.clock_s:
        why.append(f"the robot's clock is known to {evidence.clock_bound_s * 1e3:.0f} ms only")
    if not evidence.acknowledged:
        why.append(evidence.commands)
    why += evidence.doubts
    return Judgement(label="shadow" if why else "twin", why=tuple(why))
