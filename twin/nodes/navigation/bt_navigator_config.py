"""Parameters of `/bt_navigator`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from twin.parameters import Derived, Interval, Metres, NameOrPath, Nav2, NotNegative, Seconds


def _prefixes(names: Any) -> Any:
    """Return what Nav2 until Jazzy lists with an ending."""
    return [str(name).removesuffix("_error_code") for name in names] if isinstance(names, list) else names


@dataclass(frozen=True, kw_only=True)
class BtNavigatorConfig:
    """Parameters; names are those of nav2_bt_navigator, defaults too unless said otherwise."""

    default_nav_to_pose_bt_xml: Annotated[str, NameOrPath] = "navigate_to_pose"
    """Tree of goals that name none: a shipped one by name, or a path."""
    default_nav_through_poses_bt_xml: Annotated[str, NameOrPath] = "navigate_through_poses"
    """The same for goals through poses."""
    bt_loop_duration: Annotated[int, Interval(ge=1, le=1_000_000), Derived] = 100
    """Time between ticks of the tree [ms]; Nav2: 10."""
    default_server_timeout: Annotated[int, Interval(ge=1, le=1_000_000_000)] = 1000
    """How long a server may take to accept a goal, or a service to answer [ms]; Nav2: 20."""
    error_code_name_prefixes: Annotated[tuple[str, ...], Nav2("error_code_names", _prefixes)] = (
        *("assisted_teleop", "backup", "compute_path", "dock_robot", "drive_on_heading", "follow_path"),
        *("nav_thru_poses", "nav_to_pose", "smoother", "spin", "undock_robot", "wait"),
    )
    """Of the blackboard's `<prefix>_error_code` the lowest goes into the result, with its `_error_msg`."""
    odom_topic: str = "odom"
    """Of odometry, for speeds."""
    filter_duration: Annotated[Seconds, Interval(ge=0, le=1000)] = 0.3
    """Over which odometry's speed is averaged."""
    goal_reached_tol: Annotated[Metres, NotNegative] = 0.25
    """Of the node `GoalReached`."""
