"""The mutants that are known by name."""

from __future__ import annotations

from twin.experiments.mutants.mutant import Mutant
from twin.plugins import Kind

MUTANTS: Kind[Mutant] = Kind("mutant", base="twin.experiments.mutants.mutant:Mutant", group="twin.mutants")

_CATALOGUE = {
    "drive": (
        "MirroredWheel",
        "SwappedWheels",
        "MirroredEncoder",
        "WheelRadiusOff",
        "TrackOff",
        "LostBrake",
        "ClippedSpeed",
        "DoubledCommands",
        "LateCommands",
        "LateOdometry",
        "FrozenOdometry",
    ),
    "sensing": (
        "LidarYaw",
        "LidarMirrored",
        "LidarFrame",
        "LidarScale",
        "DeadRays",
        "NoisyLidar",
        "FrozenLidar",
        "LateStamps",
        "EarlyStamps",
    ),
    "localisation": ("FrozenLocalisation", "MapShifted", "MapMirrored", "WrongStart", "NoLocalisation"),
    "navigation": (
        "SmallInflation",
        "SmallFootprint",
        "NoCollisionMonitor",
        "StaleCostmap",
        "BlindCostmap",
        "BlindPlanner",
        "CoarseGoal",
        "NoRecovery",
        "HastyController",
    ),
    "manipulation": (
        "WeakGrasp",
        "EarlyGripper",
        "EarlyRelease",
        "ShallowPlace",
        "LowCarry",
        "ApproachOffset",
        "ArmOffset",
        "LiftOffset",
    ),
}


def _name(cls: str) -> str:
    """Return `mirrored_wheel` of `MirroredWheel`."""
    return "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in cls).removeprefix("_")


for _module, _classes in _CATALOGUE.items():
    for _class in _classes:
        MUTANTS.register(_name(_class), f"twin.experiments.mutants.catalogue.{_module}:{_class}")
