"""What is otherwise in the futures than in the run: parameters, faults, a goal."""

from __future__ import annotations

from typing import Any

import yaml

from twin.bridge.action_types import NavigateToPose
from twin.bridge.actions import ActionClient
from twin.bridge.actions.client import ClientGoal
from twin.bridge.node.options import BARE
from twin.bridge.services import Client
from twin.bridge.srvs import CancelGoal
from twin.bridge.types.default_values import new
from twin.errors import SimulationError, nearest
from twin.geometry import Pose2
from twin.live.perturbations import perturbed
from twin.nodes.messages import pose_stamped
from twin.runtime.run import Run
from twin.runtime.stacks.robot import RobotStack


def change(run: Run, words: tuple[str, ...]) -> None:
    """Apply what `--set` says.

    Raises:
        TwinError: There is no such node, parameter or fault; the node or the fault refuses the value.
    """
    faults = []
    for word in words:
        key, _, value = word.partition("=")
        if "." in key:
            _set_parameter(run, key, value, word)
        else:
            faults.append(word)
    if faults:
        changed, clock = perturbed(run.scenario, ",".join(faults), "--set")
        if clock.model_fields_set:
            raise SimulationError("--set clock_offset, clock_drift: a clock cannot be changed while it runs")
        run.add_faults(changed)


def send(run: Run, stack: RobotStack, goal: Pose2) -> ClientGoal:
    """Send a robot somewhere, instead of what its missions want.

    A mirror that only localises it begins to navigate here, as its scenario says.

    Raises:
        SimulationError: It does not navigate, or is not localised here.
    """
    if stack.context.config.navigation is None:
        raise SimulationError(f"--goal: robot '{stack.name}' does not navigate; it has no `navigation`")
    if stack.context.layout.autonomy == "none":
        raise SimulationError(
            f"--goal: robot '{stack.name}' is not localised here; start the mirror with --autonomy all, "
            "or localisation"
        )
    if stack.navigator is None:
        stack.navigate()
    assert stack.navigator is not None
    clients = [e for decider in run.parts.deciders for e in decider.endpoints if isinstance(e, Client)]
    cancels = {client.name: None for client in clients if client.name.endswith("/_action/cancel_goal")}
    for decider in run.parts.deciders:
        decider.destroy()
    node = run.bus.create_node("what_if", stack.context.namespace, options=BARE)
    for name in cancels:  # all goals: nobody waits for their ends any more
        node.create_client(CancelGoal, name).call_async(new(CancelGoal.Request))
    client = ActionClient(node, NavigateToPose, "navigate_to_pose")
    frame = stack.navigator.frame
    return client.send_goal(new(NavigateToPose.Goal, pose=pose_stamped(goal, frame, run.bus.clock.now_ns)))


def _set_parameter(run: Run, key: str, value: str, word: str) -> None:
    name, _, parameter = key.partition(".")
    nodes = {node.fully_qualified_name: node for node in run.bus.nodes}
    found = nodes.get(name if name.startswith("/") else f"/{name}")
    if found is None:
        raise SimulationError(f"--set {word}: there is no node '{name}'; {nearest(name, nodes)}")
    if not found.has_parameter(parameter):
        known = found.list_parameters().names
        raise SimulationError(f"--set {word}: {name} has no '{parameter}'; {nearest(parameter, known)}")
    found.set_parameter(parameter, _value(value))


def _value(text: str) -> Any:
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError:
        return text
