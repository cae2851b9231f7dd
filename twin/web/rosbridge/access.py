"""Who may do what: roles with lists of names, tokens, and which of all commands steer a robot."""

from __future__ import annotations

import hmac
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Literal

from pydantic import StringConstraints

from twin import strict_yaml
from twin.errors import BridgeError
from twin.strict_yaml import StrictModel

Kind = Literal["topic", "heard topic", "service", "action"]
Pattern = Annotated[str, StringConstraints(pattern=r"^[/*]")]
"""Of absolute names, so it begins with / or *."""

EVERYTHING = ("*",)
_READING = (
    "*/get_shapes",
    "/rosapi/*", "/twin/control", "*/get_parameters", "*/get_parameter_types", "*/list_parameters",
    "*/describe_parameters", "*/get_type_description", "*/get_state", "*/get_available_*", "*/get_map",
    "*/get_costmap", "*/get_cost", "*/map_server/map", "*/is_path_valid", "*/tf2_frames", "/republish_tfs",
    "/get_simulation_state", "/get_simulator_features",
)  # fmt: skip
_TASKS = ("*/add_task", "*/cancel_task", "*/move_task", "*/clear_tasks", "*/pause_tasks", "*/resume_tasks")
_SIMULATION = ("/set_simulation_state", "/reset_simulation", "/step_simulation", "/simulation/set_speed")
_CHANGING = ("/rosapi/set_param", "/rosapi/delete_param")
_OPERATING = (
    "*/add_shapes", "*/remove_shapes",
    "*/guard/stop", "*/guard/release", "*/clear_*", "*/reinitialize_global_localization",
    "*/set_initial_pose", "*/toggle", "/clear", "/reset", "/spawn", "/kill",
    "*/teleport_absolute", "*/teleport_relative", "*/set_pen",
    "*/pause", "*/resume", "*/_action/cancel_goal", "*/acknowledge*", *_TASKS, *_SIMULATION,
)  # fmt: skip
_TALKING = (
    "*/cmd_vel", "*/cmd_vel_teleop", "*/cmd_vel_key", "*/cmd_vel_joy", "*/teleop",
    "*/initialpose", "*/goal_pose", "*/clicked_point", "*/joy", "*/waypoints",
    "*/guard/stop", "*/guard/release", "*/keepout*", "*/speed_limit",
)  # fmt: skip

STOPS = ("*/guard/stop", "*/emergency_stop", "*/e_stop", "*/estop")
"""Names by which a robot is stopped: such a command overtakes all others and needs no control."""
READING_ACTIONS = ("/tf2_web_republisher",)
"""Actions that only tell something: their goals need no control, and end with the client that sent them."""
BY_HAND = ("guard/teleop", "cmd_vel_teleop")
"""Where a guard and a multiplexer take commands of people; whose robot has one does not steer past it."""
STEERING_TYPES = ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped")
"""Velocities: who sends them steers, and stops if it falls silent."""
STEERING_TOPICS = (
    "*/initialpose", "*/goal_pose", "*/joy", "*/waypoints", "*/guard/release", "*/keepout*", "*/speed_limit",
)  # fmt: skip
"""Other topics by which a robot is steered."""
STEERING_SERVICES = (
    "*/add_shapes", "*/remove_shapes",
    "*/guard/release", "*/reinitialize_global_localization", "*/set_initial_pose", "*/toggle",
    "*/teleport_absolute", "*/teleport_relative", "*/pause", "*/resume",
    "*/_action/send_goal", "*/_action/cancel_goal", *_TASKS, *_SIMULATION,
)  # fmt: skip
"""Services by which a robot is steered; those of other programs need a role, and no control."""


class RefusedError(BridgeError):
    """Who asked may not do that, or not now: a refusal that the audit tells of."""


def matches(name: str, patterns: Sequence[str]) -> bool:
    """Return whether an absolute name fits one of some patterns; `*` is anything, `/` too."""
    return any(fnmatchcase(name, pattern) for pattern in patterns)


@dataclass(frozen=True)
class Role:
    """What a client may do, as patterns of absolute names."""

    name: str
    topics: tuple[str, ...] = ()
    """That it may publish."""
    services: tuple[str, ...] = ()
    """That it may call."""
    actions: tuple[str, ...] = ()
    """To which it may send goals."""
    not_services: tuple[str, ...] = ()
    heard: tuple[str, ...] = EVERYTHING
    """Topics that it may subscribe to."""
    may_offer: bool = False
    """Whether it may offer services and actions of its own."""

    def allows(self, kind: Kind, name: str) -> bool:
        """Return whether it may publish or hear a topic, call a service or send goals to an action."""
        allowed = {
            "topic": self.topics,
            "heard topic": self.heard,
            "service": self.services,
            "action": self.actions,
        }[kind]
        return matches(name, allowed) and not (kind == "service" and matches(name, self.not_services))

    def check(self, kind: Kind, name: str) -> None:
        """Refuse what the role may not do.

        Raises:
            RefusedError: says what, and who may unless rules have changed that.
        """
        if not self.allows(kind, name):
            may = " or ".join(role.name for role in ROLES.values() if role.allows(kind, name))
            raise RefusedError(f"the {kind} {name} is not for the role {self.name}; it needs {may}")


ROLES = {
    role.name: role
    for role in (
        Role("viewer", services=_READING, actions=READING_ACTIONS, not_services=_CHANGING),
        Role(
            "operator",
            topics=_TALKING,
            services=(*_READING, *_OPERATING, *STOPS),
            actions=EVERYTHING,
            not_services=(*_CHANGING, "*/set_parameters", "*/set_parameters_atomically"),
        ),
        Role("engineer", EVERYTHING, EVERYTHING, EVERYTHING, may_offer=True),
    )
}
"""What clients can be, the least first."""


class RoleRules(StrictModel):
    """What one role may do, instead of what it may by itself: patterns of absolute names, `*` is anything."""

    publish: tuple[Pattern, ...] | None = None
    """Topics that it may publish."""
    subscribe: tuple[Pattern, ...] | None = None
    """Topics that it may hear."""
    call: tuple[Pattern, ...] | None = None
    """Services that it may call; then these alone decide."""
    goals: tuple[Pattern, ...] | None = None
    """Actions to which it may send goals."""
    offer: bool | None = None
    """Whether it may offer services and actions of its own."""

    def of(self, role: Role) -> Role:
        """Return a role under these rules."""

        def chosen(given: tuple[str, ...] | None, usual: tuple[str, ...]) -> tuple[str, ...]:
            return usual if given is None else given

        return Role(
            role.name,
            topics=chosen(self.publish, role.topics),
            services=chosen(self.call, role.services),
            actions=chosen(self.goals, role.actions),
            not_services=role.not_services if self.call is None else (),
            heard=chosen(self.subscribe, role.heard),
            may_offer=role.may_offer if self.offer is None else self.offer,
        )


class Rules(StrictModel):
    """Roles that are not as they are by themselves."""

    viewer: RoleRules = RoleRules()
    operator: RoleRules = RoleRules()
    engineer: RoleRules = RoleRules()


def read_rules(file: Path) -> dict[str, Role]:
    """Return the roles as a YAML file has them; what it leaves out stays as in `ROLES`.

    Raises:
        BridgeError: the file cannot be read, or has other roles, keys or values: each with its line.
    """
    rules = strict_yaml.load(file, Rules, error=BridgeError)
    return {name: getattr(rules, name).of(role) for name, role in ROLES.items()}


@dataclass(frozen=True)
class Token:
    """A secret, and what who knows it may do."""

    secret: str
    role: Role
    name: str


def read_tokens(file: Path, roles: Mapping[str, Role] = ROLES) -> tuple[Token, ...]:
    """Return the tokens of a file with lines `TOKEN ROLE [NAME]`, a name of these roles; # begins a comment.

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
        if len(words) < 2 or words[1] not in roles or len(words[0]) < 16:
            raise BridgeError(
                f"{file}:{number}: no token; valid: TOKEN ROLE [NAME], the token of 16 characters at least, "
                f"the role one of {', '.join(roles)}"
            )
        tokens.append(Token(words[0], roles[words[1]], words[2] if len(words) > 2 else words[1]))
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
