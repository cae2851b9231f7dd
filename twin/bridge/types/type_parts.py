"""What rosidl makes of a service and of an action: the messages in which they travel.

Names and order of the fields are those of rosidl_parser (definition.py); every hash depends on them.
"""

from __future__ import annotations

from typing import Any

from rosbags.interfaces import Nodetype

from twin.bridge.types.parser import Structure
from twin.bridge.types.type_hash import FieldDefs

_EVENT_INFO = "service_msgs/msg/ServiceEventInfo"


def service_parts(name: str, request: Structure, response: Structure) -> dict[str, Structure]:
    """Return the messages of a service: request, response, event."""
    parts = {field: _message(f"{name}_{field.capitalize()}") for field in ("request", "response")}
    optional = [(field, (Nodetype.SEQUENCE, (part, 1))) for field, part in parts.items()]
    event = Structure(fields=[("info", _message(_EVENT_INFO)), *optional])
    return {f"{name}_Request": request, f"{name}_Response": response, f"{name}_Event": event}


def action_parts(name: str, goal: Structure, result: Structure, feedback: Structure) -> dict[str, Structure]:
    """Return the messages of an action, those of its two services included."""
    uuid = ("goal_id", _message("unique_identifier_msgs/msg/UUID"))
    stamp = ("stamp", _message("builtin_interfaces/msg/Time"))
    return {
        f"{name}_Goal": goal,
        f"{name}_Result": result,
        f"{name}_Feedback": feedback,
        **service_parts(
            f"{name}_SendGoal",
            Structure(fields=[uuid, ("goal", _message(f"{name}_Goal"))]),
            Structure(fields=[("accepted", (Nodetype.BASE, ("bool", 0))), stamp]),
        ),
        **service_parts(
            f"{name}_GetResult",
            Structure(fields=[uuid]),
            Structure(
                fields=[("status", (Nodetype.BASE, ("int8", 0))), ("result", _message(f"{name}_Result"))]
            ),
        ),
        f"{name}_FeedbackMessage": Structure(fields=[uuid, ("feedback", _message(f"{name}_Feedback"))]),
    }


def service_structure(name: str) -> FieldDefs:
    """Return the structure as which a service is hashed."""
    suffixes = {"request_message": "_Request", "response_message": "_Response", "event_message": "_Event"}
    return _structure(name, suffixes)


def action_structures(name: str) -> FieldDefs:
    """Return the structures as which an action and its two services are hashed."""
    suffixes = {
        "goal": "_Goal",
        "result": "_Result",
        "feedback": "_Feedback",
        "send_goal_service": "_SendGoal",
        "get_result_service": "_GetResult",
        "feedback_message": "_FeedbackMessage",
    }
    services = service_structure(f"{name}_SendGoal") | service_structure(f"{name}_GetResult")
    return _structure(name, suffixes) | services


def _structure(name: str, suffixes: dict[str, str]) -> FieldDefs:
    return {name: ([], [(field, _message(name + suffix)) for field, suffix in suffixes.items()])}


def _message(name: str) -> Any:
    return Nodetype.NAME, name
