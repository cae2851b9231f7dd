"""What a case is, and the words that most of them are written with."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import mujoco

Model = mujoco.MjModel
Content = str | bytes | Callable[[Path], object]
"""Of a file, or what makes it."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """One robot file and its expected outcome."""

    urdf: Content
    files: Mapping[str, Content] = field(default_factory=dict)
    """What else lies in its folder."""
    options: tuple[str, ...] = ()
    says: tuple[str, ...] = ()
    """Of a refused file: what its error says. Of an accepted one: codes of warnings."""
    model: Callable[[Model], object] | None = None
    """Of an accepted file: what holds of its model; None means that it is refused."""
    name: str = "r.urdf"


def refused(urdf: Content, *says: str, **more: object) -> Case:
    """Return a case that ends with exit code 2, nothing written, and a message with all of `says`."""
    return Case(urdf=urdf, says=says, **more)  # type: ignore[arg-type]


def accepted(urdf: Content, model: Callable[[Model], object], *warnings: str, **more: object) -> Case:
    """Return a case that ends with a model of which `model` holds, and at least these warnings."""
    return Case(urdf=urdf, model=model, says=warnings, **more)  # type: ignore[arg-type]


INERTIAL = "<inertial><mass value='1'/><inertia ixx='.01' iyy='.01' izz='.01'/></inertial>"
LIMIT = "<limit lower='-1' upper='1' effort='1' velocity='1'/>"
BALL = "<geometry><sphere radius='.1'/></geometry>"


def link(name: str = "a", inside: str = INERTIAL) -> str:
    """Return a link."""
    return f"<link name='{name}'>{inside}</link>"


def joint(
    name: str = "j", kind: str = "continuous", inside: str = "", parent: str = "a", child: str = "b"
) -> str:
    """Return a joint, by default between the links of `pair`."""
    ends = f"<parent link='{parent}'/><child link='{child}'/>"
    return f"<joint name='{name}' type='{kind}'>{ends}{inside}</joint>"


def robot(*parts: str, head: str = "name='r'") -> str:
    """Return a robot file."""
    return f"<robot {head}>{''.join(parts)}</robot>"


def pair(*parts: str, **of_joint: str) -> str:
    """Return a robot of links `a` and `b`, joint `j` between them, and more parts."""
    return robot(link("a"), link("b"), joint(**of_joint), *parts)


def chain(kind: str, count: int, inside: str = "") -> str:
    """Return `count` links in a row, `l0` to …, with joints `j1` to … ."""
    links = [link(f"l{index}") for index in range(count)]
    joints = [joint(f"j{i}", kind, inside, f"l{i - 1}", f"l{i}") for i in range(1, count)]
    return robot(*links, *joints)


def shaped(geometry: str, role: str = "collision") -> str:
    """Return a robot of one link with one shape."""
    return robot(link("a", f"{INERTIAL}<{role}><geometry>{geometry}</geometry></{role}>"))
