"""The capstone's mission: fetch totes from shelves and set them down in the unloading zone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from twin.bridge.bus import Bus
from twin.manipulation.telescopic_arm import TelescopicArm
from twin.navigation.behavior_trees.node import TreeNode
from twin.nodes.missions.leaves import sequence, with_recovery
from twin.nodes.navigation.robot_pose import RobotPose
from twin.warehouse.skills import MobileManipulationNode, Station


@dataclass(frozen=True, kw_only=True)
class PickAndPlaceTask:
    """One tote to carry."""

    tote: str
    tote_width: float
    """Between the fingers [m]."""
    box_depth: float
    """Along the reach [m]."""
    tote_height: float
    """[m]"""
    pick: Station
    place: Station


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

    def __init__(
        self,
        bus: Bus,
        tasks: Sequence[PickAndPlaceTask],
        arm: TelescopicArm,
        *,
        gripper_joint: str,
        gripper_open: float,
        robot_pose: RobotPose,
        config: PickAndPlaceConfig | None = None,
        period_ns: int = 100_000_000,
        namespace: str = "",
    ) -> None:
        super().__init__(
            bus,
            arm,
            gripper_joint=gripper_joint,
            gripper_open=gripper_open,
            robot_pose=robot_pose,
            namespace=namespace,
        )
        self.config = config or PickAndPlaceConfig()
        self.run(sequence("PickAndPlace", [self._task(task) for task in tasks]), period_ns)

    def _task(self, task: PickAndPlaceTask) -> TreeNode:
        carry_z = self.config.carry_z
        give_up = [
            self.stop_looking(),
            self.open_gripper(),
            self.retract(),
            self.undock_from("shelf"),
            self.stow(carry_z),
            self.report(f"{task.tote}: drive to {task.pick.name} again"),
            self.drive_to(task.pick),
        ]
        pick = with_recovery(
            "PickWithRetries",
            self.config.pick_attempts - 1,
            self._pick(task),
            sequence("ReleaseAndStageAgain", give_up),
        )
        return sequence(
            task.tote,
            [
                self.report(f"{task.tote}: drive to {task.pick.name}"),
                self.stow(carry_z),
                self.drive_to(task.pick),
                pick,
                self.holding(task.tote, task.tote_width, [*self._carry(task), *self._set_down(task)]),
                self.report(f"{task.tote}: release"),
                self.open_gripper(),
                self.report(f"{task.tote}: back off"),
                self.retract(),
                self.undock_from("table"),
                self.stow(carry_z),
            ],
        )

    def _pick(self, task: PickAndPlaceTask) -> TreeNode:
        surface = task.pick.surface_z
        grasp_z = surface + task.tote_height / 2.0
        return sequence(
            "Pick",
            [
                self.report(f"{task.tote}: dock at {task.pick.name}"),
                self.open_gripper(),
                self.move_to_height("RaiseToLook", surface + self.config.detection_height),
                self.start_looking(),
                self.dock_at(task.pick, "tote"),
                self.report(f"{task.tote}: look"),
                self.look(),
                self.stop_looking(),
                self.report(f"{task.tote}: reach"),
                self.reach_for_tote(grasp_z, task.box_depth),
                self.report(f"{task.tote}: grasp"),
                self.close_on(task.tote_width),
                self.holding(
                    task.tote,
                    task.tote_width,
                    [
                        self.move_to_height("LiftOff", grasp_z + self.config.lift_off, loaded=True),
                        self.report(f"{task.tote}: retract"),
                        self.retract(loaded=True),
                    ],
                ),
            ],
        )

    def _carry(self, task: PickAndPlaceTask) -> list[TreeNode]:
        return [
            self.report(f"{task.tote}: back off"),
            self.undock_from("shelf"),
            self.move_to_height("LowerToCarry", self.config.carry_z, loaded=True),
            self.report(f"{task.tote}: carry to {task.place.name}"),
            self.drive_to(task.place),
        ]

    def _set_down(self, task: PickAndPlaceTask) -> list[TreeNode]:
        config = self.config
        set_down = task.place.surface_z + task.tote_height / 2.0 + config.set_down_clearance
        above = set_down + config.lift_off
        x = self.skills.docked_distance + config.place_depth
        dock = with_recovery(
            "DockWithRetries",
            config.dock_attempts - 1,
            self.dock_at(task.place, "table"),
            sequence("StageAgain", [self.undock_from("table"), self.drive_to(task.place)]),
        )
        return [
            self.report(f"{task.tote}: dock at {task.place.name}"),
            dock,
            self.report(f"{task.tote}: set down"),
            self.move_to_height("RaiseToPlace", above, loaded=True),
            self.reach("ReachToPlace", x, above, loaded=True),
            self.move_to_height("Lower", set_down, loaded=True),
        ]
