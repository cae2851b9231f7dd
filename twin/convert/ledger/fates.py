"""What the ledgers of all kinds of elements share."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Literal

from twin.models.checks.ignored import ATTRIBUTES
from twin.models.urdf.document import Element

Outcome = Literal["kept", "translated", "guessed", "dropped"]
"""kept: means the same in MuJoCo. translated: other words, same meaning. guessed: the file does not say, or
not what is possible, so something was chosen. dropped: has no effect in the model."""
Fate = tuple[Outcome, str]
"""What became of an element, and how or why."""
NOISE: Fate = ("translated", "noise of the sensor; MuJoCo itself adds none")
INSIDE: Fate = ("translated", "see what is inside")
NO_EFFECT: Fate = ("dropped", "nothing in it has an effect")
LOST: Mapping[str, str] = MappingProxyType(
    {"robot": "version", "link": "type", "visual": "name", "collision": "name"}
)
"""Attributes that URDF has and MJCF does not."""
EXTENSIONS: Mapping[str, str] = MappingProxyType(
    {
        "gazebo": "reference",
        "plugin": "name filename",
        "sensor": "name type",
        "camera": "name",
        "ros2_control": "name type",
        "transmission": "name type",
        "actuator": "name",
        "command_interface": "name",
        "state_interface": "name",
        "param": "name",
        "noise": "type",
        "pose": "degrees",
    }
)
"""Attributes with an effect outside of URDF's own elements, beside `value`, which stands for the text."""


def lost_attributes(element: Element) -> Iterator[str]:
    """Yield the attributes of an element that have no effect although the element has one."""
    known = ATTRIBUTES if element.tag in ATTRIBUTES else EXTENSIONS
    effective = [*known.get(element.tag, "").split(), "value"]
    lost = LOST.get(element.tag, "").split()
    yield from (name for name in element.attrib if name not in effective or name in lost)


def container_fate(element: Element, fate_of: Callable[[Element], Fate], own: Fate = INSIDE) -> Fate:
    """Return `own` for an element in which something has an effect."""
    return own if any(fate_of(child)[0] != "dropped" for child in element) else NO_EFFECT
