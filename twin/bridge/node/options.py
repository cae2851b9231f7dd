"""What a node is created with, beside its name."""

from __future__ import annotations

from dataclasses import dataclass, field

from twin.bridge.programs.ros_args import RosArguments


@dataclass(frozen=True, kw_only=True)
class NodeOptions:
    """rclpy's arguments of a node; see `Bus.create_node`."""

    arguments: RosArguments = field(default_factory=RosArguments)
    """What the command line says: names, parameters, remappings, log levels."""
    allow_undeclared_parameters: bool = False
    """Whether a parameter may be set that the node did not declare."""
    automatically_declare_parameters_from_overrides: bool = False
    """Whether every value given at the start becomes a parameter."""
    start_parameter_services: bool = True
    """Whether others may see and change the parameters, and hear of changes before the first one."""
    start_parameter_event_publisher: bool = True
    """Whether changes of parameters are told on /parameter_events."""
    enable_rosout: bool = True
    """Whether the node is on /rosout before its first message, where there is a network."""
    start_type_description_service: bool = True
    """Whether others may ask what its types are: `~/get_type_description`."""
    enable_logger_service: bool = False
    """Whether others may see and change log levels: `~/get_logger_levels` and `~/set_logger_levels`."""


BARE = NodeOptions(start_parameter_services=False, enable_rosout=False, start_type_description_service=False)
"""For tools that only look: nothing but what they create."""
