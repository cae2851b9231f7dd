"""A node's scans: since when none of use has come, and why."""

from __future__ import annotations

from twin.bridge.msgs import LaserScan
from twin.navigation.scan_watch import ScanWatch
from twin.nodes.navigation.robot_pose import RobotPose


class ScanInput:
    """Lets through what can be believed, and remembers when that was."""

    def __init__(self, robot_pose: RobotPose, now_ns: int) -> None:
        """Wait for the first scan from `now_ns` on."""
        self._robot_pose = robot_pose
        self._watch = ScanWatch()
        self._good_ns = now_ns
        self._why = ""
        self._heard_ns = now_ns

    def accept(self, message: LaserScan, now_ns: int) -> bool:
        """Take a scan at `now_ns`; return whether it is of use."""
        self._heard_ns = now_ns
        self._why = self._watch.fault(message.ranges, self._robot_pose.in_odom())
        if not self._why:
            self._good_ns = now_ns
        return not self._why

    def fault(self, now_ns: int, tolerance_ns: int) -> str:
        """Return what is wrong, in words, if nothing of use has come for longer than `tolerance_ns`."""
        missing = now_ns - self._good_ns
        if missing <= tolerance_ns:
            return ""
        if not self._why or now_ns - self._heard_ns > tolerance_ns:
            return f"no scan for {missing * 1e-9:.1f} s"
        return f"no usable scan for {missing * 1e-9:.1f} s: {self._why}"
