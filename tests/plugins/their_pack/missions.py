from dataclasses import dataclass
from typing import Annotated

from their_pack.used import USED
from twin.bridge.action_types import NavigateToPose
from twin.bridge.actions import ActionClient
from twin.bridge.msgs import Bool, PoseArray, new
from twin.bridge.srvs import SetBool
from twin.geometry import Pose2
from twin.nodes.messages import pose_stamped
from twin.nodes.missions.mission_node import MissionNode
from twin.parameters import Metres, Positive


class Errand(MissionNode):
    """Drives some way ahead; on the way the sensor of the other robot and the own detector tell something."""

    @dataclass(frozen=True, kw_only=True)
    class Config:
        distance: Annotated[Metres, Positive]

    def __init__(self, context, config):
        super().__init__(context.bus, namespace=context.namespace)
        self.config, self.robot_pose, self.heard, self.goal = config, context.robot.robot_pose, set(), None
        self.action = ActionClient(self.node, NavigateToPose, "navigate_to_pose")
        self.enable = self.node.create_client(SetBool, "tote_detector/enable")
        self.node.create_subscription(Bool, "/stone/warm", lambda message: self.heard.add("warm"))
        self.node.create_subscription(PoseArray, "tote_poses", lambda message: self.heard.add("box"))
        self.node.create_timer(100_000_000, self.tick)

    def tick(self):
        USED.add("Errand")
        here = self.robot_pose.in_map()
        if self.goal is None and here is not None:
            self.enable.call_async(new(SetBool.Request, data=True))
            there = here @ Pose2(self.config.distance, 0.0, 0.0)
            self.goal = self.action.send_goal(
                new(NavigateToPose.Goal, pose=pose_stamped(there, self.robot_pose.frames.map, 0))
            )
        elif self.goal is not None and self.goal.done and not self.done:
            if not self.goal.succeeded:
                self.note(self.goal.result.error_msg)
            self.finish(self.goal.succeeded and self.heard == {"warm", "box"})
