"""`/futures`: others ask a run by it what will become of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from twin.bridge import types
from twin.bridge.cdr.codec import codec
from twin.bridge.conversions import pose_from_pose2
from twin.bridge.msgs import Path, PoseStamped, header
from twin.bridge.node.options import NodeOptions
from twin.bridge.qos import LATCHED
from twin.bridge.services import Respond
from twin.bridge.srvs import Trigger
from twin.bridge.topics.raw_publisher import RawPublisher
from twin.errors import SimulationError, TwinError
from twin.geometry import Pose2
from twin.live.futures.futures import Answer, Futures
from twin.live.futures.inputs import Inputs
from twin.live.futures.names import NODE, RUN, SNAPSHOT
from twin.live.futures.outcome import Outcome
from twin.live.futures.snapshot import Snapshot
from twin.live.futures.what_if import WhatIf, parsed_goal
from twin.runtime.open_run import OpenRun

_FRAME = "map"
_OPTIONS = NodeOptions(enable_rosout=False, start_parameter_event_publisher=False)
"""It publishes nothing of its own: that somebody asks is no part of what the run was."""


def parameters_of(asked: WhatIf) -> dict[str, Any]:
    """Return what is asked as parameters of the node."""
    goal = "" if asked.goal is None else ",".join(map(repr, asked.goal))
    return {**asked.to_dict(), "horizon": float(asked.horizon), "goal": goal, "set": list(asked.set) or [""]}


class FuturesNode:
    """Takes what is asked as parameters, and answers it by services, while the run goes on."""

    def __init__(self, run: OpenRun, inputs: Inputs | None = None) -> None:
        """Make the node; the run closes it.

        Args:
            run: Before its first tick.
            inputs: What came from outside so far, if it is kept.
        """
        self._run, self._inputs = run, inputs
        self._asked: tuple[WhatIf, Respond] | None = None
        self._futures: Futures | None = None
        self._at_ns = 0
        """When they began, by the clock of the nodes."""
        self._snapshots: list[Respond] = []
        """Who waits for one."""
        self._ghosts: list[RawPublisher] = []
        self.node = run.run.bus.create_node(NODE.strip("/"), options=_OPTIONS)
        for name, value in parameters_of(WhatIf()).items():
            self.node.declare_parameter(name, value)
        self.node.create_deferred_service(Trigger, RUN, self._on_run)
        self.node.create_deferred_service(
            Trigger, SNAPSHOT, lambda _, respond: self._snapshots.append(respond)
        )
        run.between_ticks.append(self._between_ticks)
        run.on_close(self.close)

    def close(self) -> None:
        """End the futures that are under way. Harmless when repeated."""
        if self._futures is not None:
            self._futures.close()
        if self._asked is not None:
            self._answer(Trigger.Response(False, "the run has ended before its futures were there"))

    def _on_run(self, request: Any, respond: Respond) -> None:
        if self._asked is not None:
            why = "the futures that somebody has asked for are not there yet; ask again when they are"
            respond(Trigger.Response(False, why))
            return
        try:
            self._asked = self._question(), respond
        except TwinError as wrong:
            respond(Trigger.Response(False, str(wrong)))

    def _question(self) -> WhatIf:
        given = {name: self.node.get_parameter(name).value for name in parameters_of(WhatIf())}
        goal, words = given["goal"], tuple(filter(None, given["set"]))
        return WhatIf(**{**given, "goal": parsed_goal(goal) if goal else None, "set": words})

    def _between_ticks(self) -> None:
        while self._snapshots:
            self._snapshots.pop()(self._snapshot())
        if self._asked is None:
            return
        asked = self._asked[0]
        try:
            if self._futures is None:
                self._futures = Futures(self._run, asked, politely=True)
                self._at_ns = self.node.now_ns
            answer = self._futures.poll()
            if answer is None:
                return
            self._show(answer)
            response = Trigger.Response(True, answer.to_json())
        except TwinError as wrong:
            response = Trigger.Response(False, str(wrong))
        self._answer(response)

    def _answer(self, response: Any) -> None:
        assert self._asked is not None
        _, respond = self._asked
        self._asked = self._futures = None
        respond(response)

    def _snapshot(self) -> Any:
        try:
            if not self._run.run.parts.clock.is_simulated:
                why = "a mirror has no snapshot: what came into it came by other clocks, and comes so once"
                raise SimulationError(why)
            if self._inputs is None:
                raise SimulationError("the run keeps no inputs; start it with `twin run … --keep-inputs`")
            return Trigger.Response(True, Snapshot.of(self._run, self._inputs).to_json())
        except TwinError as wrong:
            return Trigger.Response(False, str(wrong))

    def _show(self, answer: Answer) -> None:
        """Draw the paths, on topics too; those of the answer before go."""
        at_ns = self._at_ns
        paths: Sequence[Outcome | None] = [
            *answer.outcomes,
            *[None] * (len(self._ghosts) - len(answer.outcomes)),
        ]
        for index, outcome in enumerate(paths):
            poses = () if outcome is None else outcome.path
            message = Path(
                header=header(at_ns, _FRAME),
                poses=[
                    PoseStamped(
                        header=header(at_ns + round(t * 1e9), _FRAME), pose=pose_from_pose2(Pose2(x, y, yaw))
                    )
                    for t, x, y, yaw in poses
                ],
            )
            self._run.show(f"{NODE}/path_{index + 1}", message)
            if self._run.run.bus.networked:
                self._ghost(index).publish(codec(Path).encode(message))

    def _ghost(self, index: int) -> RawPublisher:
        """Return the publisher of a future's path; of bytes, so that its messages are no part of the run."""
        while len(self._ghosts) <= index:
            name, topic = codec(Path).msgtype, f"{NODE}/path_{len(self._ghosts) + 1}"
            self._ghosts.append(RawPublisher(self.node, topic, name, types.rihs01(name), LATCHED))
        return self._ghosts[index]
