"""Action types by their ROS names; `NavigateToPose.Goal`, `.Result`, `.Feedback` are message classes."""

from __future__ import annotations

from twin.bridge.types import ActionType

AssistedTeleop = ActionType("nav2_msgs/action/AssistedTeleop")
BackUp = ActionType("nav2_msgs/action/BackUp")
ComputePathThroughPoses = ActionType("nav2_msgs/action/ComputePathThroughPoses")
ComputePathToPose = ActionType("nav2_msgs/action/ComputePathToPose")
DockRobot = ActionType("nav2_msgs/action/DockRobot")
DriveOnHeading = ActionType("nav2_msgs/action/DriveOnHeading")
Fibonacci = ActionType("example_interfaces/action/Fibonacci")
FollowJointTrajectory = ActionType("control_msgs/action/FollowJointTrajectory")
FollowPath = ActionType("nav2_msgs/action/FollowPath")
FollowWaypoints = ActionType("nav2_msgs/action/FollowWaypoints")
GripperCommand = ActionType("control_msgs/action/GripperCommand")
NavigateThroughPoses = ActionType("nav2_msgs/action/NavigateThroughPoses")
NavigateToPose = ActionType("nav2_msgs/action/NavigateToPose")
SmoothPath = ActionType("nav2_msgs/action/SmoothPath")
Spin = ActionType("nav2_msgs/action/Spin")
UndockRobot = ActionType("nav2_msgs/action/UndockRobot")
Wait = ActionType("nav2_msgs/action/Wait")
