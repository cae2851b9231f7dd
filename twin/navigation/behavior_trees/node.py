"""The base of every tree node: status, ports, children (BehaviorTree.CPP, tree_node.cpp)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, ClassVar

from twin.errors import NavigationError
from twin.navigation.behavior_trees.blackboard import Blackboard
from twin.navigation.behavior_trees.ports import Port, is_pointer, read_value


class Status(Enum):
    """What a tick says; a node keeps it until its parent resets it."""

    IDLE = "IDLE"
    RUNNING = "RUNNING"
    SUCCESS = "SUCCESS"
    FAILURE = "FAILURE"
    SKIPPED = "SKIPPED"

    @property
    def is_active(self) -> bool:
        """Whether the node was ticked since it was reset."""
        return self in (Status.RUNNING, Status.SUCCESS, Status.FAILURE)

    @property
    def is_completed(self) -> bool:
        """Whether it succeeded or failed."""
        return self in (Status.SUCCESS, Status.FAILURE)


class TreeContext:
    """What nodes may know of the world around their tree."""

    def __init__(self, now_ns: Callable[[], int]) -> None:
        self.now_ns = now_ns
        """Simulated time, for durations [ns]."""
        self.on_transition: Callable[[TreeNode, Status, Status], None] = lambda node, before, now: None
        """Told of every change of a node's status."""
        self.on_recovery: Callable[[str], None] = lambda name: None
        """Told when a `RoundRobin`, which holds the recoveries in Nav2's trees, starts one of them."""
        self.recovering = False
        """Whether a `RoundRobin` is at one of them."""
        self.woken = False
        """A node that runs had no need to wait: the tree is to be ticked again at once."""


@dataclass(frozen=True, kw_only=True)
class NodeSetup:
    """What a node is made with."""

    name: str
    uid: int
    """1 is the root; unique in its tree."""
    context: TreeContext
    blackboard: Blackboard
    ports: Mapping[str, str] = field(default_factory=dict)
    """Port -> its text in the file; ports that the file leaves out are not in it."""
    children: tuple[TreeNode, ...] = ()


class TreeNode(ABC):
    """A node; `tick` says what it does, `halt` how it stops while it runs."""

    KIND: ClassVar[str] = "Action"
    """Action, Condition, Control or Decorator, as the explicit form of the XML has it."""
    PORTS: ClassVar[tuple[Port, ...]] = ()
    CHILDREN: ClassVar[tuple[int, int | None]] = (0, 0)
    """Fewest and most children; None: any number."""

    def __init__(self, setup: NodeSetup) -> None:
        self.name, self.uid, self.children = setup.name, setup.uid, setup.children
        self.context, self.blackboard = setup.context, setup.blackboard
        self.status = Status.IDLE
        self._texts = setup.ports
        self._ports = {port.name: port for port in self.PORTS}

    @abstractmethod
    def tick(self) -> Status:
        """Do the node's work once; RUNNING, SUCCESS, FAILURE or SKIPPED."""

    def halt(self) -> None:
        """Stop running, and reset the children; only called while the status is RUNNING."""
        self.reset_children()

    def execute_tick(self) -> Status:
        """Tick and keep the status; a node that is skipped stays as it was."""
        status = self.tick()
        if status is not Status.SKIPPED:
            self.set_status(status)
        return status

    def set_status(self, status: Status) -> None:
        """Change the status, and tell whoever watches."""
        before, self.status = self.status, status
        if before is not status:
            self.context.on_transition(self, before, status)

    def reset(self) -> None:
        """Halt if running, and be idle."""
        if self.status is Status.RUNNING:
            self.halt()
        self.set_status(Status.IDLE)

    def reset_children(self) -> None:
        """Reset every child."""
        for child in self.children:
            child.reset()

    # Ports

    def get(self, name: str) -> Any:
        """Return an input port's value; None if it is empty and has no default.

        Raises:
            NavigationError: the blackboard's entry is a text that is no such value.
        """
        port, text = self._ports[name], self._texts.get(name)
        if text is None:
            return port.default
        if not is_pointer(text):
            return read_value(text, port.type)
        value = self.blackboard.get(self._entry(name, text))
        if isinstance(value, str) and port.type not in ("string", "any", "message"):
            try:
                return read_value(value, port.type)
            except ValueError as error:
                raise NavigationError(f"{self.name}: {name} {error}; {text} is {value!r}") from error
        return port.default if value is None else value

    def get_or_entry(self, name: str) -> Any:
        """Return a port's value, or the blackboard entry of its name if the file leaves the port out."""
        return self.get(name) if name in self._texts else self.blackboard.get(name)

    def put(self, name: str, value: Any) -> None:
        """Write an output port; nothing if the file leaves it out."""
        text = self._texts.get(name)
        if text is not None:
            self.blackboard.set(self._entry(name, text) if is_pointer(text) else text, value)

    @staticmethod
    def _entry(name: str, text: str) -> str:
        return name if text == "{=}" else text[1:-1]


class ControlNode(TreeNode):
    """A node with children."""

    KIND = "Control"
    CHILDREN: ClassVar[tuple[int, int | None]] = (1, None)

    def end(self, status: Status) -> Status:
        """Begin anew next time; return the status with which this time ends."""
        self.halt()
        return status


class DecoratorNode(TreeNode):
    """A node with one child."""

    KIND = "Decorator"
    CHILDREN = (1, 1)

    @property
    def child(self) -> TreeNode:
        """The child."""
        return self.children[0]

    def execute_tick(self) -> Status:
        """Tick; a child that has completed is idle afterwards."""
        status = super().execute_tick()
        if self.child.status.is_completed:
            self.child.set_status(Status.IDLE)
        return status


class ConditionNode(TreeNode):
    """A leaf that only looks."""

    KIND = "Condition"

    @abstractmethod
    def holds(self) -> bool:
        """Whether the condition is true."""

    def tick(self) -> Status:
        """Look."""
        return Status.SUCCESS if self.holds() else Status.FAILURE
