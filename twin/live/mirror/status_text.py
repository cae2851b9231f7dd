"""How robots are mirrored, for a terminal of 80 columns."""

from __future__ import annotations

import math
from collections.abc import Sequence

from twin.geometry import Pose2
from twin.live.mirror.status import Status


def status_text(statuses: Sequence[Status]) -> str:
    """Return both poses of each robot, their difference, the label and why it is no more."""
    return "\n\n".join(map(_block, statuses))


def _block(status: Status) -> str:
    evidence, judgement = status.evidence, status.judgement
    lines = [f"{status.robot}  {judgement.label.upper()}"]
    lines += [f"  because     {why}" for why in judgement.why]
    lines += [f"  alarm       {alarm}" for alarm in status.alarms]
    lines.append(f"  physical    {_pose(status.physical)}")
    lines.append(f"  virtual     {_pose(status.virtual)}")
    if evidence.position is not None and evidence.yaw is not None:
        apart = f"{evidence.position:.3f} m, {math.degrees(evidence.yaw):+.1f} deg apart"
        age = "" if evidence.age_s is None else f", seen {evidence.age_s:.2f} s ago"
        lines.append(f"  difference  {apart}{age}")
    if status.clock_offset_s is not None:
        bound = evidence.clock_bound_s
        known = "" if bound is None else f", known to {1e3 * bound:.1f} ms"
        lines.append(f"  clock       {status.clock_offset_s:+.4f} s from ours{known}")
    if status.delay_s is not None:
        delay, jitter = status.delay_s
        lines.append(f"  link        data come {1e3 * delay:.0f} ms late, within {1e3 * jitter:.0f} ms")
    lines += [f"  {name:<11} {words}" for name, words in status.told.items()]
    lines.append(f"  commands    {evidence.commands}")
    if status.resets:
        times = "once" if status.resets == 1 else f"{status.resets} times"
        lines.append(f"  put where the physical robot is: {times}")
    return "\n".join(lines)


def _pose(pose: Pose2 | None) -> str:
    if pose is None:
        return "not seen"
    return f"x {pose.x:+8.3f} m  y {pose.y:+8.3f} m  yaw {math.degrees(pose.yaw):+7.1f} deg"
