"""The mutants that are known by name."""

from __future__ import annotations

from twin.experiments.mutants.mutant import Mutant
from twin.plugins import Kind

MUTANTS: Kind[Mutant] = Kind("mutant", base="twin.experiments.mutants.mutant:Mutant", group="twin.mutants")

_CATALOGUE = {
    "drive": """mirrored_wheel swapped_wheels mirrored_encoder wheel_radius_off track_off lost_brake
        clipped_speed doubled_commands late_commands late_odometry frozen_odometry""",
    "sensing": """lidar_yaw lidar_mirrored lidar_frame lidar_scale dead_rays noisy_lidar frozen_lidar
        late_stamps early_stamps""",
    "localisation": "frozen_localisation map_shifted map_mirrored wrong_start no_localisation",
    "navigation": """small_inflation small_footprint no_collision_monitor stale_costmap blind_costmap
        blind_planner coarse_goal no_recovery hasty_controller""",
    "manipulation": """weak_grasp early_gripper early_release shallow_place low_carry approach_offset
        arm_offset lift_offset""",
}
"""Those of each module of the catalogue, which is imported when one of them is used."""

for _module, _names in _CATALOGUE.items():
    for _name in _names.split():
        MUTANTS.register(_name, f"twin.experiments.mutants.catalogue.{_module}:{_name}")
