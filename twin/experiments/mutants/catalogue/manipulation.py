"""Arms, grippers and missions that handle goods wrongly."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from twin.experiments.mutants.catalogue.navigation import group, navigating
from twin.experiments.mutants.mutant import Mutant, NotHere, Site
from twin.runtime.defaults import from_description
from twin.runtime.run import Run
from twin.runtime.stacks.missions import Missions
from twin.warehouse.pick_and_place import PickAndPlaceNode
from twin.warehouse.skills import MobileManipulationNode


class _OfManipulators(Mutant):
    """Spoils how goods are handled; there must be somebody who does."""

    def adjust(self, run: Run) -> None:
        """Look for missions that handle goods, and spoil them."""
        mission = run.parts.mission
        missions = mission.of.values() if isinstance(mission, Missions) else [mission]
        found = [each for each in missions if isinstance(each, MobileManipulationNode)]
        if not found:
            raise NotHere("no robot handles goods")
        for each in found:
            self.spoil(each)

    def spoil(self, mission: MobileManipulationNode) -> None:
        """Change a mission that was built."""


class WeakGrasp(_OfManipulators):
    """The gripper presses with a tenth of its force."""

    def spoil(self, mission: MobileManipulationNode) -> None:
        """Change the skills."""
        mission.skills = replace(mission.skills, gripper_effort=0.1 * mission.skills.gripper_effort)


class EarlyGripper(_OfManipulators):
    """The gripper closes 12 cm before the goods are between its fingers."""

    def install(self, site: Site) -> None:
        """Stop reaching too soon."""
        reach = MobileManipulationNode.reach_for_tote

        def short(mission: MobileManipulationNode, z: float, depth: float) -> Any:
            return reach(mission, z, depth - 0.24)

        site.patch(MobileManipulationNode, "reach_for_tote", short)


class EarlyRelease(_OfManipulators):
    """The gripper opens 12 cm above the table."""

    def install(self, site: Site) -> None:
        """Set down too high."""
        _plan(site, set_down_clearance=0.12, lift_off=0.12)


class ShallowPlace(_OfManipulators):
    """Goods are set down on the edge of the table."""

    def install(self, site: Site) -> None:
        """Set down too near."""
        _plan(site, place_depth=0.04)


class LowCarry(_OfManipulators):
    """Goods are drawn out of the shelf without being lifted."""

    def install(self, site: Site) -> None:
        """Lift nothing."""
        _plan(site, lift_off=0.0)


class ApproachOffset(_OfManipulators):
    """Docks are approached 12 cm too near."""

    def edit(self, data: dict[str, Any]) -> None:
        """Change what docks there are."""
        for navigation in navigating(data):
            types = group(group(navigation, "docking"), "types")
            for name in ("tote", "shelf", "table"):
                group(types, name)["external_detection_translation_x"] = "-0.43 m"


class ArmOffset(_OfManipulators):
    """The robot takes its gripper to be 8 cm nearer than it is."""

    def install(self, site: Site) -> None:
        """Change what is known of the arm."""
        _calibrate(site, grasp_length=-0.08)


class LiftOffset(_OfManipulators):
    """The robot takes its gripper to be 5 cm lower than it is."""

    def install(self, site: Site) -> None:
        """Change what is known of the arm."""
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
