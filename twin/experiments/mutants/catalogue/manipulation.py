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


@_of_goods
@installs
def early_release(site: Site) -> None:
    """The gripper opens 12 cm above the table."""
    _plan(site, set_down_clearance=0.12, lift_off=0.12)


@_of_goods
@installs
def shallow_place(site: Site) -> None:
    """Goods are set down on the edge of the table."""
    _plan(site, place_depth=0.04)


@_of_goods
@installs
def low_carry(site: Site) -> None:
    """Goods are drawn out of the shelf without being lifted."""
    _plan(site, lift_off=0.0)


@_of_goods
@edits
def approach_offset(data: dict[str, Any]) -> None:
    """Docks are approached 12 cm too near."""
    for navigation in navigating(data):
        types = group(group(navigation, "docking"), "types")
        for name in ("tote", "shelf", "table"):
            group(types, name)["external_detection_translation_x"] = "-0.43 m"


@_of_goods
@installs
def arm_offset(site: Site) -> None:
    """The robot takes its gripper to be 8 cm nearer than it is."""
    _calibrate(site, grasp_length=-0.08)


@_of_goods
@installs
def lift_offset(site: Site) -> None:
    """The robot takes its gripper to be 5 cm lower than it is."""
    _calibrate(site, grasp_z=-0.05)


def _plan(site: Site, **distances: Any) -> None:
    site.patch(PickAndPlaceNode, "config", replace(PickAndPlaceNode.config, **distances))


def _calibrate(site: Site, **offsets: float) -> None:
    real = from_description.manipulator

    def wrong(description: Any) -> Any:
        found = real(description)
        if found is not None:
            config = found.arm.config
            shifted = {name: getattr(config, name) + offset for name, offset in offsets.items()}
            found.arm.config = replace(config, **shifted)
        return found

    site.patch(from_description, "manipulator", wrong)
