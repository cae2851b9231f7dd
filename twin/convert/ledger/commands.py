"""What became of `<ros2_control>` and `<transmission>`."""

from __future__ import annotations

from twin.convert.ledger.fates import Fate, container_fate
from twin.models.description import RobotDescription
from twin.models.urdf.commands import (
    HARDWARE,
    Transmission,
    command_interface,
    hardware_interface,
    transmissions,
)
from twin.models.urdf.document import Element
from twin.models.urdf.gazebo import number_in

HARDWARE_ONLY: Fate = ("dropped", "a matter of the hardware")


class CommandFates:
    """Knows of each element of `<ros2_control>` and `<transmission>` what became of it."""

    def __init__(self, root: Element, description: RobotDescription) -> None:
        """Look through the text `root` of `description`."""
        self._description = description
        self._interfaces: dict[str, Element] = {}
        for joint in root.iterfind("ros2_control/joint"):
            interface = command_interface(joint)
            if interface is not None:
                self._interfaces.setdefault(joint.get("name"), interface)
        self._spoken_of = {joint.get("name") for joint in root.iterfind("ros2_control/joint")}
        self._transmissions = {item.element: item for item in transmissions(root, description.joints)}
        self._first: dict[str, Transmission] = {}
        for item in self._transmissions.values():
            if item.joint is not None:
                self._first.setdefault(item.joint, item)

    def of(self, element: Element) -> Fate:
        """Return the fate of one element."""
        areas = [item for item in (element, *element.iterancestors()) if item.getparent() is not None]
        if areas[-1].tag == "transmission":
            return self._transmission(element, self._transmissions[areas[-1]])
        return self._ros2_control(element)

    def _ros2_control(self, element: Element) -> Fate:
        parent = element.getparent()
        if element.tag == "ros2_control" or (element.tag == "joint" and parent.tag == "ros2_control"):
            return container_fate(element, self._ros2_control)
        if element.tag == "command_interface" and parent.tag == "joint":
            name = parent.get("name")
            if self._interfaces.get(name) is element and name in self._description.commands:
                return "translated", f"actuator '{name}'"
            return "dropped", "the first command interface of a joint that MuJoCo has counts"
        if element.tag == "state_interface" and parent.tag == "joint":
            states = self._description.states.get(parent.get("name"), ())
            known = element.get("name") in states
            return ("translated", "sensor of the joint") if known else ("dropped", "nothing to measure")
        if element.tag == "param":
            return self._param(element)
        return HARDWARE_ONLY

    def _param(self, element: Element) -> Fate:
        parent, name = element.getparent(), element.get("name")
        if parent.tag == "command_interface" and name in ("min", "max"):
            if self._ros2_control(parent)[0] != "dropped" and number_in(element) is not None:
                return "translated", "ctrlrange of the actuator"
            return "dropped", "its command interface has no effect, or it is no number"
        if parent.tag == "joint" and name in ("mimic", "multiplier"):
            return "dropped", "<mimic> of the joint itself counts"
        return HARDWARE_ONLY

    def _transmission(self, element: Element, item: Transmission) -> Fate:
        reason = item.fault
        if item.joint is not None and item.joint in self._spoken_of:
            reason = f"<ros2_control> says how joint '{item.joint}' is commanded"
        elif item.joint is not None and self._first[item.joint] is not item:
            reason = f"the first transmission of joint '{item.joint}' counts"
        if reason:
            return "dropped", reason
        if element is item.element:
            return "translated", f"actuator '{item.joint}', commanded by {item.interface}"
        if element.tag == "type":
            return "kept", "one motor, one joint"
        if element.tag == "joint":
            return "translated", "the actuator's joint"
        if element.tag == "hardwareInterface":
            return self._hardware_interface(element, item)
        if element.tag == "mechanicalReduction":
            if number_in(element) == 1.0:
                return "kept", "motor and joint turn alike"
            ratio = f"{item.reduction:g}:1"
            return "dropped", f"commands and efforts are the joint's, as in ros_control ({ratio})"
        if element.tag == "actuator":
            return container_fate(element, lambda child: self._transmission(child, item))
        return HARDWARE_ONLY

    def _hardware_interface(self, element: Element, item: Transmission) -> Fate:
        every = item.element.iter("hardwareInterface")
        found = [interface for interface in every if hardware_interface(interface) in HARDWARE]
        if found and found[0] is element:
            return "translated", f"{item.interface} actuator"
        again = bool(found) and (found[0].text or "").strip() == (element.text or "").strip()
        return ("kept", "the same once more") if again else ("dropped", "the first hardware interface counts")
