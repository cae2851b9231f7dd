"""Signals: numbers, texts and truth values that a run shows over time, by the names that formulas give them.

`SIGNALS` are those of the simulator's truth; the fields of topics are signals, too (`topic`).
"""

from __future__ import annotations

from twin.plugins import Kind
from twin.scenario.signals.signal import RobotSignal as RobotSignal
from twin.scenario.signals.signal import Signal as Signal

SIGNALS: Kind[Signal] = Kind("signal", base="twin.scenario.signals:Signal", group="twin.signals")

SIGNALS.register("x", "twin.scenario.signals.motion:X")
SIGNALS.register("y", "twin.scenario.signals.motion:Y")
SIGNALS.register("z", "twin.scenario.signals.motion:Z")
SIGNALS.register("yaw", "twin.scenario.signals.motion:Yaw")
SIGNALS.register("tilt", "twin.scenario.signals.motion:Tilt")
SIGNALS.register("speed", "twin.scenario.signals.motion:Speed")
SIGNALS.register("turn_rate", "twin.scenario.signals.motion:TurnRate")
SIGNALS.register("acceleration", "twin.scenario.signals.motion:Acceleration")
SIGNALS.register("jerk", "twin.scenario.signals.motion:Jerk")
SIGNALS.register("driven_distance", "twin.scenario.signals.motion:DrivenDistance")
SIGNALS.register("path_efficiency", "twin.scenario.signals.motion:PathEfficiency")
SIGNALS.register("distance_to", "twin.scenario.signals.places:DistanceTo")
SIGNALS.register("distance_to_zone", "twin.scenario.signals.places:DistanceToZone")
SIGNALS.register("distance_to_start", "twin.scenario.signals.places:DistanceToStart")
SIGNALS.register("distance_to_goal", "twin.scenario.signals.places:DistanceToGoal")
SIGNALS.register("distance_to_circle", "twin.scenario.signals.places:DistanceToCircle")
SIGNALS.register("turned_from", "twin.scenario.signals.places:TurnedFrom")
SIGNALS.register("turned_from_start", "twin.scenario.signals.places:TurnedFromStart")
SIGNALS.register("clearance", "twin.scenario.signals.touch:Clearance")
SIGNALS.register("contact_force", "twin.scenario.signals.touch:ContactForce")
SIGNALS.register("slip", "twin.scenario.signals.effort:Slip")
SIGNALS.register("energy", "twin.scenario.signals.effort:Energy")
SIGNALS.register("localisation_error", "twin.scenario.signals.belief:LocalisationError")
SIGNALS.register("localisation_rms", "twin.scenario.signals.belief:LocalisationRms")
SIGNALS.register("heading_error", "twin.scenario.signals.belief:HeadingError")
SIGNALS.register("odometry_drift", "twin.scenario.signals.belief:OdometryDrift")
SIGNALS.register("goals", "twin.scenario.signals.task:Goals")
SIGNALS.register("recoveries", "twin.scenario.signals.task:Recoveries")
SIGNALS.register("time_in_recoveries", "twin.scenario.signals.task:TimeInRecoveries")
SIGNALS.register("mission_state", "twin.scenario.signals.task:MissionState")
SIGNALS.register("mission_done", "twin.scenario.signals.task:MissionDone")
SIGNALS.register("mission_succeeded", "twin.scenario.signals.task:MissionSucceeded")
