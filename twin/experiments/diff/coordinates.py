"""The physics state as one array, and what each number of it is called."""

from __future__ import annotations

from itertools import chain

import numpy as np

from twin.geometry import Array
from twin.sim.world import World

_FREE = 0
"""MuJoCo's mjJNT_FREE."""
_POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")
_TWIST = ("vx", "vy", "vz", "wx", "wy", "wz")
_POSITIONS = (_POSE, _POSE[3:], ("position",), ("position",))
"""Of MuJoCo's types of joints, in its order: free, ball, slide, hinge."""
_VELOCITIES = (_TWIST, _TWIST[3:], ("velocity",), ("velocity",))


def state(world: World) -> Array:
    """Return positions, velocities, activations and kinematic poses, as the digest has them; shape (n,)."""
    data = world.data
    parts = (data.qpos, data.qvel, data.act, data.mocap_pos.ravel(), data.mocap_quat.ravel())
    return np.concatenate(parts)


def state_names(world: World) -> tuple[str, ...]:
    """Return a name for each number of `state`, such as `position of diff_bot/left_wheel_joint`."""
    model = world.model
    joints = [(int(kind), _joint(world, index)) for index, kind in enumerate(model.jnt_type)]
    placed = [model.body(int(body)).name for body in np.flatnonzero(model.body_mocapid >= 0)]
    return tuple(
        chain(
            (f"{name} of {joint}" for kind, joint in joints for name in _POSITIONS[kind]),
            (f"{name} of {joint}" for kind, joint in joints for name in _VELOCITIES[kind]),
            (f"activation {index}" for index in range(model.na)),
            (f"{name} of {body}" for body in placed for name in _POSE[:3]),
            (f"{name} of {body}" for body in placed for name in _POSE[3:]),
        )
    )


def _joint(world: World, index: int) -> str:
    model = world.model
    if model.jnt_type[index] == _FREE:
        return model.body(int(model.jnt_bodyid[index])).name
    return model.joint(index).name
