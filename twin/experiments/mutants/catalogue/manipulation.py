"""Arms, grippers and missions that handle goods wrongly."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from twin.experiments.mutants.catalogue import adjusts, edits, installs
from twin.experiments.mutants.catalogue.navigation import group, navigating
from twin.experiments.mutants.mutant import Mutant, NotHere, Site
from twin.runtime.defaults import from_description
from twin.runtime.run import Run
from twin.runtime.stacks.missions import Missions
from twin.warehouse.pick_and_place import PickAndPlaceNode
from twin.warehouse.skills import MobileManipulationNode


def _handling(run: Run) -> list[MobileManipulationNode]:
    """Return the missions that handle goods."""
    mission = run.parts.mission
    missions = mission.of.values() if isinstance(mission, Missions) else [mission]
    found = [each for each in missions if isinstance(each, MobileManipulationNode)]
    if not found:
        raise NotHere("no robot handles goods")
    return found


def _of_goods(mutant: type[Mutant]) -> type[Mutant]:
    """Let a mutant see that there is somebody who handles goods."""
    mutant.adjust = lambda self, run: _handling(run)  # type: ignore[method-assign, assignment]
    return mutant


@adjusts
def weak_grasp(run: Run) -> None:
    """The gripper presses with a tenth of its force."""
    for each in _handling(run):
        each.skills = replace(each.skills, gripper_effort=0.1 * each.skills.gripper_effort)


@_of_goods
@installs
def early_gripper(site: Site) -> None:
    """The gripper closes 12 cm before the goods are between its fingers."""
    reach = MobileManipulationNode.reach_for_tote

    def short(mission: MobileManipulationNode, z: float, depth: float) -> Any:
        return reach(mission, z, depth - 0.24)

    site.patch(MobileManipulationNode, "reach_for_tote", short)


def _plans(says: str, **distances: Any) -> type[Mutant]:
    """Make a mutant that changes distances of the plan of picking and placing."""

    def change(site: Site) -> None:
        site.patch(PickAndPlaceNode, "config", replace(PickAndPlaceNode.config, **distances))

    change.__doc__ = says
    return _of_goods(installs(change))


early_release = _plans("The gripper opens 12 cm above the table.", set_down_clearance=0.12, lift_off=0.12)
shallow_place = _plans("Goods are set down on the edge of the table.", place_depth=0.04)
low_carry = _plans("Goods are drawn out of the shelf without being lifted.", lift_off=0.0)


@_of_goods
@edits
def approach_offset(data: dict[str, Any]) -> None:
    """Docks are approached 12 cm too near."""
    for navigation in navigating(data):
        types = group(group(navigation, "docking"), "types")
        for name in ("tote", "shelf", "table"):
            group(types, name)["external_detection_translation_x"] = "-0.43 m"


def _calibrates(says: str, **offsets: float) -> type[Mutant]:
    """Make a mutant that changes what is known of the arm."""

    def change(site: Site) -> None:
        real = from_description.manipulator

        def wrong(description: Any) -> Any:
            found = real(description)
            if found is not None:
                config = found.arm.config
                shifted = {name: getattr(config, name) + offset for name, offset in offsets.items()}
                found.arm.config = replace(config, **shifted)
            return found

        site.patch(from_description, "manipulator", wrong)

    change.__doc__ = says
    return _of_goods(installs(change))


arm_offset = _calibrates("The robot takes its gripper to be 8 cm nearer than it is.", grasp_length=-0.08)
lift_offset = _calibrates("The robot takes its gripper to be 5 cm lower than it is.", grasp_z=-0.05)
