"""Tasks that carry totes from where they stand to tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from twin.errors import TaskError, nearest
from twin.navigation.behavior_trees.node import TreeNode
from twin.nodes.missions.leaves import Do, sequence
from twin.nodes.missions.tasks.kinds import TaskKind, place
from twin.warehouse.arena import Arena
from twin.warehouse.pick_and_place import PickAndPlaceNode, PickAndPlaceTask
from twin.warehouse.shelf import Slot, Tote


class Carry(TaskKind):
    """Knows where totes stand, as far as this robot has moved them."""

    name = "carry"

    def __init__(self, robot: PickAndPlaceNode, arena: Arena) -> None:
        """Begin with all totes of an arena in their slots."""
        self._robot, self._arena = robot, arena
        self._at = {name: tote.slot for name, tote in arena.totes.items()}
        """Where each stands, unless the gripper has taken it since."""
        self._tables = {name: zone.slots for name, zone in arena.zones.items() if zone.slots}
        self._slots = {slot.name: slot for slots in self._tables.values() for slot in slots}
        self._is_under_way = False

    def check(self, task: Any) -> str:
        """Find the tote, and room for it."""
        tote = self._tote(task.tote)
        self._free(task.to, tote)
        return f"carry {tote.name} to {task.to}"

    def tree(self, task: Any) -> TreeNode:
        """Fetch it unless the gripper holds it already, and set it down."""
        tote, held = self._tote(task.tote), self._robot.holds
        if held is not None and held is not tote:
            raise TaskError(f"the gripper holds {held.name}; carry that first")
        slot = self._free(task.to, tote)
        work = PickAndPlaceTask(tote=tote, place=slot)
        self._is_under_way = True
        carry = self._robot.task(work) if held is None else self._robot.rest_of(work)

        def arrived() -> None:
            self._at[tote.name], self._is_under_way = slot, False
            self._robot.gripped.discard(tote.name)

        return sequence("Carry", [carry, Do("Arrived", arrived)])

    def tidy(self) -> TreeNode | None:
        """Return what brings the arm back over the deck if a task was broken off."""
        if not self._is_under_way:
            return None

        def done() -> None:
            self._is_under_way = False

        return sequence("Tidy", [self._robot.put_away(), Do("Tidied", done)])

    def places(self) -> Sequence[Any]:
        """Return the totes, and where they can be carried."""
        totes = [place("tote", name, tote.T_map_tote.to_pose2()) for name, tote in self._arena.totes.items()]
        zones = [place("slot", name, self._arena.zones[name].pose) for name in self._tables]
        slots = [place("slot", name, slot.T_map_slot.to_pose2()) for name, slot in self._slots.items()]
        return [*totes, *zones, *slots]

    def _tote(self, name: str) -> Tote:
        totes, held, lost = self._arena.totes, self._robot.holds, self._robot.gripped
        standing = [each for each, at in self._at.items() if each not in lost and at.name not in self._slots]
        valid = [*standing, *([] if held is None else [held.name])]
        if name not in totes:
            raise TaskError(f"there is no tote '{name}'; {nearest(name, valid)}")
        if name not in valid:
            where = "was lost on the way" if name in lost else f"stands in {self._at[name].name} already"
            raise TaskError(f"{name} {where}; {nearest(name, valid)}")
        return totes[name]

    def _free(self, name: str, tote: Tote) -> Slot:
        taken = [at.name for at in self._at.values()]
        if name not in self._tables and name not in self._slots:
            raise TaskError(
                f"{tote.name} cannot be carried to '{name}'; {nearest(name, (*self._tables, *self._slots))}"
            )
        slots = self._tables.get(name) or (self._slots[name],)
        free = [slot for slot in slots if slot.name not in taken]
        if not free:
            every = [slot for slot in self._slots if slot not in taken]
            raise TaskError(f"there is no room in {name}; {nearest(name, every)}")
        return free[0]
