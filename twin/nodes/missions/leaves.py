"""What missions are made of: leaves that call an action or a service, ask, or do; and how they are joined."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

from twin.bridge.actions import ActionClient, ClientGoal
from twin.bridge.services import Client, Future
from twin.navigation.behavior_trees import sequences
from twin.navigation.behavior_trees.blackboard import Blackboard
from twin.navigation.behavior_trees.nav2_control import RecoveryNode
from twin.navigation.behavior_trees.node import NodeSetup, Status, TreeContext, TreeNode


def sequence(name: str, children: Sequence[TreeNode]) -> TreeNode:
    """Return a node that ticks its children one after the other, until one fails."""
    return sequences.Sequence(_setup(name, *children))


def while_true(condition: TreeNode, node: TreeNode) -> TreeNode:
    """Return a node that ticks `node` while `condition` succeeds; it halts it and fails when that fails."""
    return sequences.ReactiveSequence(_setup(f"While[{condition.name}]", condition, node))


def with_recovery(name: str, retries: int, main: TreeNode, recovery: TreeNode) -> TreeNode:
    """Return a node that, when `main` fails, runs `recovery` and tries again, at most `retries` times."""
    return RecoveryNode(_setup(name, main, recovery, number_of_retries=str(retries)))


def _setup(name: str, *children: TreeNode, **ports: str) -> NodeSetup:
    """Return what a node of a mission is made with; none of them uses blackboard or clock."""
    context = TreeContext(lambda: 0)
    return NodeSetup(
        name=name, uid=0, context=context, blackboard=Blackboard(), ports=ports, children=children
    )


class MissionLeaf(TreeNode):
    """A leaf: `begin` is called when it starts, `update` at every tick."""

    def __init__(self, name: str) -> None:
        super().__init__(_setup(name))
        self.reason = ""
        """Why it failed."""

    def begin(self) -> None:
        """Start."""
        return

    @abstractmethod
    def update(self) -> Status:
        """Look how it is doing."""

    def tick(self) -> Status:
        """Begin if it does not run, and look."""
        if self.status is not Status.RUNNING:
            self.reason = ""
            self.begin()
        return self.update()

    def fail(self, reason: str) -> Status:
        """Fail for a reason."""
        self.reason = reason
        return Status.FAILURE


class CallAction(MissionLeaf):
    """Sends a goal and waits for its result; cancels it when halted (Nav2's `BtActionNode`).

    Args:
        name: Shown in logs and in the recording.
        client: Of the action.
        goal: Makes the goal at the start; returns None if it cannot, after saying why, and the leaf fails.
        on_result: Takes the result of a goal that succeeded; a returned text is a reason to fail after all.
        on_failure: Takes the text that says why it failed.
    """

    def __init__(
        self,
        name: str,
        client: ActionClient,
        goal: Callable[[], Any | None],
        *,
        on_result: Callable[[Any], str | None] | None = None,
        on_failure: Callable[[str], None] | None = None,
    ) -> None:
        super().__init__(name)
        self._client = client
        self._make_goal = goal
        self._on_result = on_result
        self._on_failure = on_failure
        self._goal: ClientGoal | None = None

    def begin(self) -> None:
        """Send the goal."""
        goal = self._make_goal()
        self._goal = None if goal is None else self._client.send_goal(goal)

    def update(self) -> Status:
        """Look whether the result is there."""
        if self._goal is None:
            return self.fail("no goal could be made")
        if self._goal.accepted is False:
            return self.fail(self._goal.error or f"{self._client.name} rejected the goal")
        if not self._goal.done:
            return Status.RUNNING
        if not self._goal.succeeded:
            texts = (getattr(self._goal.result, name, "") for name in ("error_msg", "error_string"))
            return self.fail(next(filter(None, texts), f"{self._client.name} was aborted"))
        reason = self._on_result(self._goal.result) if self._on_result else None
        return Status.SUCCESS if reason is None else self.fail(reason)

    def halt(self) -> None:
        """Cancel the goal."""
        if self._goal is not None and not self._goal.done:
            self._goal.cancel()

    def fail(self, reason: str) -> Status:
        """Fail, and tell the reason."""
        if self._on_failure is not None and self._goal is not None:
            self._on_failure(f"{self.name}: {reason}")
        return super().fail(reason)


class CallService(MissionLeaf):
    """Calls a service and waits for the answer (Nav2's `BtServiceNode`)."""

    def __init__(
        self,
        name: str,
        client: Client,
        request: Callable[[], Any],
        accept: Callable[[Any], bool] = lambda response: True,
    ) -> None:
        super().__init__(name)
        self._client = client
        self._request = request
        self._accept = accept
        self._future: Future | None = None

    def begin(self) -> None:
        """Send the request."""
        self._future = self._client.call_async(self._request())

    def update(self) -> Status:
        """Look whether the answer is there."""
        assert self._future is not None
        if not self._future.done:
            return Status.RUNNING
        if self._future.error is not None:
            return self.fail(self._future.error)
        return Status.SUCCESS if self._accept(self._future.result) else Status.FAILURE


class Condition(MissionLeaf):
    """Succeeds while `test` holds."""

    OTHERWISE = Status.FAILURE

    def __init__(self, name: str, test: Callable[[], bool]) -> None:
        super().__init__(name)
        self._test = test

    def update(self) -> Status:
        """Ask."""
        return Status.SUCCESS if self._test() else self.OTHERWISE


class WaitUntil(Condition):
    """Runs until `test` holds."""

    OTHERWISE = Status.RUNNING


class Do(MissionLeaf):
    """Does something that is over at once; a returned text is the reason why it failed."""

    def __init__(self, name: str, action: Callable[[], str | None]) -> None:
        super().__init__(name)
        self._action = action

    def update(self) -> Status:
        """Do it."""
        reason = self._action()
        return Status.SUCCESS if reason is None else self.fail(reason)
