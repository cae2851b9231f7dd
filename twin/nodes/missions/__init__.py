"""What robots are to do, as nodes."""

from twin.nodes.missions.mission_node import MissionNode as MissionNode
