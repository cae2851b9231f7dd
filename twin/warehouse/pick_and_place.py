"""The capstone's mission: fetch totes from shelves and set them down in the unloading zone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from twin.navigation.behavior_trees.node import TreeNode
from twin.nodes.missions.leaves import sequence, with_recovery
from twin.warehouse.shelf import Slot, Tote
from twin.warehouse.skills import MobileManipulationNode


@dataclass(frozen=True, kw_only=True)
class PickAndPlaceTask:
    """One tote to carry."""

    tote: Tote
    """Between the fingers is its width, along the reach its depth."""
    place: Slot
    """On a table."""


@dataclass(frozen=True, kw_only=True)
class PickAndPlaceConfig:
    """Distances of picking and placing."""

    detection_height: float = 0.09
    """Of the grasp frame above the surface while docking and looking for the tote [m]."""
    place_depth: float = 0.24
    """From the table's face to the tote's centre [m]."""
    lift_off: float = 0.05
    """Raised above the surface before the arm moves with the tote [m]."""
    set_down_clearance: float = 0.002
    """Between tote and surface when the gripper opens [m]."""
    carry_z: float = 0.45
    """Height of the grasp frame while driving with a tote [m]."""
    pick_attempts: int = 3
    """Docking and grasping is tried this often, each time from the staging pose."""
    dock_attempts: int = 3
    """Docking at the table is tried this often."""


class PickAndPlaceNode(MobileManipulationNode):
    """Runs the tasks one after the other, each as a behaviour tree."""

    config = PickAndPlaceConfig()

    def carry(self, tasks: Sequence[PickAndPlaceTask]) -> None:
        """Begin with the first of the tasks."""
        self.run(sequence("PickAndPlace", [self.task(task) for task in tasks]), 100_000_000)

    def task(self, task: PickAndPlaceTask) -> TreeNode:
        """Return what carries a tote from where it stands."""
        carry_z, tote = self.config.carry_z, task.tote
        give_up = [
            self.detect("StopLooking", enabled=False),
            self.open_gripper(),
            self.retract(),
            self.undock_from("shelf"),
            self.stow(carry_z),
            self.report(f"{tote.name}: drive to {tote.slot.name} again"),
            self.drive_to(tote.slot),
        ]
        pick = with_recovery(
            "PickWithRetries",
            self.config.pick_attempts - 1,
            self._pick(tote),
            sequence("ReleaseAndStageAgain", give_up),
        )
        return sequence(
            tote.name,
            [
                self.report(f"{tote.name}: drive to {tote.slot.name}"),
                self.stow(carry_z),
                self.drive_to(tote.slot),
                pick,
                self.holding(tote, [*self._leave(task), *self._carry(task), *self._set_down(task)]),
                *self._release(task),
            ],
        )

    def rest_of(self, task: PickAndPlaceTask) -> TreeNode:
        """Return what carries the tote that the gripper holds, after `put_away`."""
        carried = self.holding(task.tote, [*self._carry(task), *self._set_down(task)])
        return sequence(task.tote.name, [carried, *self._release(task)])

    def put_away(self) -> TreeNode:
        """Return what makes the robot ready to drive wherever it was broken off; it keeps what it holds."""
        carry_z, held = self.config.carry_z, self.holds is not None
        fingers = self.raise_by("LiftOff", self.config.lift_off) if held else self.open_gripper()
        return sequence(
            "PutAway",
            [
                self.detect("StopLooking", enabled=False),
                fingers,
                self.retract(loaded=held),
                *([self.undock_from("shelf")] if self.is_docked else []),
                self.move_to_height("LowerToCarry", carry_z, loaded=held),
            ],
        )

    def _pick(self, tote: Tote) -> TreeNode:
        surface, (depth, _, height) = tote.slot.height, tote.size
        grasp_z = surface + height / 2.0
        return sequence(
            "Pick",
            [
                self.report(f"{tote.name}: dock at {tote.slot.name}"),
                self.open_gripper(),
                self.move_to_height("RaiseToLook", surface + self.config.detection_height),
                self.detect("StartLooking", enabled=True),
                self.dock_at(tote.slot, "tote"),
                self.report(f"{tote.name}: look"),
                self.look(),
                self.detect("StopLooking", enabled=False),
                self.report(f"{tote.name}: reach"),
                self.reach_for_tote(grasp_z, depth),
                self.report(f"{tote.name}: grasp"),
                self.close_on(tote),
                self.holding(
                    tote,
                    [
                        self.move_to_height("LiftOff", grasp_z + self.config.lift_off, loaded=True),
                        self.report(f"{tote.name}: retract"),
                        self.retract(loaded=True),
                    ],
                ),
            ],
        )

    def _leave(self, task: PickAndPlaceTask) -> list[TreeNode]:
        return [
            self.report(f"{task.tote.name}: back off"),
            self.undock_from("shelf"),
            self.move_to_height("LowerToCarry", self.config.carry_z, loaded=True),
        ]

    def _carry(self, task: PickAndPlaceTask) -> list[TreeNode]:
        return [
            self.report(f"{task.tote.name}: carry to {task.place.name}"),
            self.drive_to(task.place),
        ]

    def _set_down(self, task: PickAndPlaceTask) -> list[TreeNode]:
        config = self.config
        set_down = task.place.height + task.tote.size[2] / 2.0 + config.set_down_clearance
        above = set_down + config.lift_off
        x = self.skills.docked_distance + config.place_depth
        dock = with_recovery(
            "DockWithRetries",
            config.dock_attempts - 1,
            self.dock_at(task.place, "table"),
            sequence("StageAgain", [self.undock_from("table"), self.drive_to(task.place)]),
        )
        return [
            self.report(f"{task.tote.name}: dock at {task.place.name}"),
            dock,
            self.report(f"{task.tote.name}: set down"),
            self.move_to_height("RaiseToPlace", above, loaded=True),
            self.reach("ReachToPlace", x, above, loaded=True),
            self.move_to_height("Lower", set_down, loaded=True),
        ]

    def _release(self, task: PickAndPlaceTask) -> list[TreeNode]:
        return [
            self.report(f"{task.tote.name}: release"),
            self.open_gripper(),
            self.report(f"{task.tote.name}: back off"),
            self.retract(),
            self.undock_from("table"),
            self.stow(self.config.carry_z),
        ]
