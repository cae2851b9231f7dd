"""Who may do what: roles with lists of names, tokens, and which of all commands steer a robot."""

from __future__ import annotations

import hmac
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from twin.errors import BridgeError

EVERYTHING = ("*",)
_READING = (
    "/rosapi/*", "/twin/control", "*/get_parameters", "*/get_parameter_types", "*/list_parameters",
    "*/describe_parameters", "*/get_type_description", "*/get_state", "*/get_available_*", "*/get_map",
    "*/get_costmap", "*/get_cost", "*/map_server/map", "*/is_path_valid", "*/tf2_frames",
)  # fmt: skip
_CHANGING = ("/rosapi/set_param", "/rosapi/delete_param")
_OPERATING = (
    "*/guard/stop", "*/guard/release", "*/clear_*", "*/reinitialize_global_localization",
    "*/set_initial_pose", "*/toggle", "/clear", "/reset", "/spawn", "/kill", "/turtle*/*",
    "*/add_task", "*/cancel_task", "*/pause", "*/resume", "*/_action/cancel_goal", "*/acknowledge*",
)  # fmt: skip
_TALKING = (
    "*/cmd_vel*", "*/teleop", "*/initialpose", "*/goal_pose", "*/clicked_point", "*/joy", "*/waypoints",
    "*/guard/stop", "*/guard/release", "*/keepout*", "*/speed_limit",
)  # fmt: skip

STOPS = ("*/guard/stop", "*/emergency_stop", "*/e_stop", "*/estop")
"""Names by which a robot is stopped: such a command overtakes all others and needs no control."""
STEERING_TYPES = ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped")
"""Velocities: who sends them steers, and stops if it falls silent."""
STEERING_TOPICS = ("*/initialpose", "*/goal_pose", "*/joy", "*/waypoints")
"""Other topics by which a robot is steered."""


def matches(name: str, patterns: Sequence[str]) -> bool:
    """Return whether an absolute name fits one of some patterns; `*` is anything, `/` too."""
    return any(fnmatchcase(name, pattern) for pattern in patterns)


@dataclass(frozen=True)
class Role:
    """What a client may do, as patterns of absolute names. All may subscribe."""

    name: str
    topics: tuple[str, ...] = ()
    """That it may publish."""
    services: tuple[str, ...] = ()
    """That it may call."""
    actions: tuple[str, ...] = ()
    """To which it may send goals."""
    not_services: tuple[str, ...] = ()
    may_offer: bool = False
    """Whether it may offer services and actions of its own."""

    def allows(self, kind: str, name: str) -> bool:
        """Return whether it may publish a topic, call a service or send goals to an action of this name."""
        allowed = {"topic": self.topics, "service": self.services, "action": self.actions}[kind]
        return matches(name, allowed) and not (kind == "service" and matches(name, self.not_services))

    def check(self, kind: str, name: str) -> None:
        """Refuse what the role may not do.

        Raises:
            BridgeError: says what, and who may.
        """
        if not self.allows(kind, name):
            may = " or ".join(role.name for role in ROLES.values() if role.allows(kind, name))
            raise BridgeError(f"the {kind} {name} is not for the role {self.name}; it needs {may}")


ROLES = {
    role.name: role
    for role in (
        Role("viewer", services=_READING, not_services=_CHANGING),
        Role(
            "operator",
            topics=_TALKING,
            services=(*_READING, *_OPERATING, *STOPS),
            actions=EVERYTHING,
            not_services=_CHANGING,
        ),
        Role("engineer", EVERYTHING, EVERYTHING, EVERYTHING, may_offer=True),
    )
}
"""What clients can be, the least first."""


@dataclass(frozen=True)
class Token:
    """A secret, and what who knows it may do."""

    secret: str
    role: Role
    name: str


def read_tokens(file: Path) -> tuple[Token, ...]:
    """Return the tokens of a file with lines `TOKEN ROLE [NAME]`; # begins a comment.

    Raises:
        BridgeError: the file cannot be read, or a line is of another form; tells no token.
    """
    try:
        lines = file.read_text("utf-8").splitlines()
    except (OSError, ValueError) as error:
        raise BridgeError(f"{file}: the tokens cannot be read: {error}") from None
    tokens = []
    for number, line in enumerate(lines, 1):
        words = line.partition("#")[0].split(maxsplit=2)
        if not words:
            continue
        if len(words) < 2 or words[1] not in ROLES or len(words[0]) < 16:
            raise BridgeError(
                f"{file}:{number}: no token; valid: TOKEN ROLE [NAME], the token of 16 characters at least, "
                f"the role one of {', '.join(ROLES)}"
            )
        tokens.append(Token(words[0], ROLES[words[1]], words[2] if len(words) > 2 else words[1]))
    if not tokens:
        raise BridgeError(f"{file} holds no token; valid: lines of TOKEN ROLE [NAME]")
    return tuple(tokens)


def find_token(tokens: Sequence[Token], secret: str) -> Token | None:
    """Return the token that a secret is; takes as long for every secret."""
    found = None
    for token in tokens:
        if hmac.compare_digest(token.secret.encode(), secret.encode("utf-8", "replace")):
            found = token
    return found
