"""How wheels touch the ground: stiff, without hopping, and with the rolling radius that the file gives."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from twin.controllers.skid_steer import weight_shares
from twin.convert.contact_roles import Roles
from twin.geometry import Array
from twin.models.dynamics import STANDARD_GRAVITY

STIFF_SOLREF_S = 0.004
"""Contact time constant of wheels and gripping surfaces [s]; at least two time steps.

Softer, a wheel sinks in and rolls with a smaller radius, and a gripped box creeps: measured 7.7 mm against
1.0 mm per 5 m, and 0.68 mm against 0.23 mm in a shaken grasp.
"""
STIFF_SOLIMP = (0.9, 0.95, 0.001, 0.5, 2.0)
"""MuJoCo's default: a force that jumps to its full size at the first touch."""
ELASTIC_WIDTH = 0.35
"""Penetration at which a skid-steered wheel's contact gets hard, per time constant [m/s]: 1.4 mm at 4 ms.

Wheels that scrub push the robot sideways at the ground; on a hard contact four or more of them then hop
(measured: loads that jump between zero and twice their mean, and a robot that turns at 0.4 to 0.9 of its
rate). A force that grows from zero, as a tyre's does, keeps all wheels down.
"""


def wheel_contact(roles: Roles, timestep: float) -> dict[str, Any]:
    """Return solref and solimp of a robot's wheels for a simulation with `timestep` [s]."""
    time_constant = stiff(timestep)[0]
    if not roles.skid_steer:
        return {"solref": stiff(timestep), "solimp": list(STIFF_SOLIMP)}
    return {"solref": stiff(timestep), "solimp": [0.0, 0.95, ELASTIC_WIDTH * time_constant, 0.5, 2.0]}


def stiff(timestep: float) -> list[float]:
    """Return the stiffest solref that a simulation with `timestep` [s] can follow, critically damped."""
    return [max(STIFF_SOLREF_S, 2.0 * timestep), 1.0]


def carry_load(spec: mujoco.MjSpec, model: mujoco.MjModel, roles: Roles) -> None:
    """Let contacts of wheels begin as early as the wheels sink in under the robot's own weight.

    So they carry it where they just touch, and roll with the file's radius: without this margin a robot
    drives 0.02 to 0.7 % short.

    Args:
        spec: Its wheels' geoms get the margin.
        model: `spec` compiled, with the robot standing upright at joint position zero.
        roles: Names the wheels.
    """
    if not roles.wheels:
        return
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    names = sorted(roles.wheels)
    bodies = [model.body(name).id for name in names]
    weight = STANDARD_GRAVITY * float(model.body_subtreemass[1])
    shares = weight_shares(data.xpos[bodies, :2], data.subtree_com[1, :2])
    for name, body, share in zip(names, bodies, shares, strict=True):
        load = share * weight * float(model.body_invweight0[body, 0])
        for geom in spec.body(name).geoms:
            if geom.contype:
                geom.margin = static_sink(load, np.array(geom.solref), np.array(geom.solimp))


def static_sink(load: float, solref: Array, solimp: Array) -> float:
    """Return how deep a contact at rest is [m].

    MuJoCo's contact: force = k d / ((1 - d) A) · depth with k = d / (d_max · time constant · damping ratio)²,
    impedance d(depth), and A the body's inverse weight.

    Args:
        load: Force times A [m/s²].
        solref: Time constant [s] and damping ratio.
        solimp: d_0, d_max, width [m], midpoint, power.
    """
    time_constant, ratio = solref
    stiffness = 1.0 / (solimp[1] * time_constant * ratio) ** 2

    def carried(depth: float) -> float:
        d = _impedance(depth, solimp)
        return stiffness * d * d / (1.0 - d) * depth

    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2.0
        low, high = (middle, high) if carried(middle) < load else (low, middle)
    return (low + high) / 2.0


def _impedance(depth: float, solimp: Array) -> float:
    """Return d(depth) as MuJoCo's computation chapter gives it."""
    start, end, width, middle, power = solimp
    x = min(depth / width, 1.0)
    if x <= middle:
        y = x**power / middle ** (power - 1.0)
    else:
        y = 1.0 - (1.0 - x) ** power / (1.0 - middle) ** (power - 1.0)
    return float(np.clip(start + y * (end - start), 1e-4, 0.9999))
