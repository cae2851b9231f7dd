"""Service types by their ROS names; `Trigger.Request`, `Trigger.Response` are message classes."""

from __future__ import annotations

from twin.bridge.types import ServiceType

AddTwoInts = ServiceType("example_interfaces/srv/AddTwoInts")
CancelGoal = ServiceType("action_msgs/srv/CancelGoal")
ClearCostmapAroundPose = ServiceType("nav2_msgs/srv/ClearCostmapAroundPose")
ClearCostmapAroundRobot = ServiceType("nav2_msgs/srv/ClearCostmapAroundRobot")
ClearCostmapExceptRegion = ServiceType("nav2_msgs/srv/ClearCostmapExceptRegion")
ClearEntireCostmap = ServiceType("nav2_msgs/srv/ClearEntireCostmap")
DescribeParameters = ServiceType("rcl_interfaces/srv/DescribeParameters")
Empty = ServiceType("std_srvs/srv/Empty")
GetCost = ServiceType("nav2_msgs/srv/GetCost")
GetCostmap = ServiceType("nav2_msgs/srv/GetCostmap")
GetMap = ServiceType("nav_msgs/srv/GetMap")
GetParameterTypes = ServiceType("rcl_interfaces/srv/GetParameterTypes")
GetParameters = ServiceType("rcl_interfaces/srv/GetParameters")
GetPlan = ServiceType("nav_msgs/srv/GetPlan")
IsPathValid = ServiceType("nav2_msgs/srv/IsPathValid")
ListParameters = ServiceType("rcl_interfaces/srv/ListParameters")
LoadMap = ServiceType("nav2_msgs/srv/LoadMap")
ManageLifecycleNodes = ServiceType("nav2_msgs/srv/ManageLifecycleNodes")
SaveMap = ServiceType("nav2_msgs/srv/SaveMap")
SetBool = ServiceType("std_srvs/srv/SetBool")
SetInitialPose = ServiceType("nav2_msgs/srv/SetInitialPose")
SetMap = ServiceType("nav_msgs/srv/SetMap")
SetParameters = ServiceType("rcl_interfaces/srv/SetParameters")
SetParametersAtomically = ServiceType("rcl_interfaces/srv/SetParametersAtomically")
Toggle = ServiceType("nav2_msgs/srv/Toggle")
Trigger = ServiceType("std_srvs/srv/Trigger")
