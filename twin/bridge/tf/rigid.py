"""Rigid motions as tuples of floats, by tf2's formulas: at this size far cheaper than arrays.

tf2 turns a vector by q·v·q* and neither needs nor makes unit quaternions (LinearMath/Quaternion.h); so does
this, and a rotation that was rounded somewhere gives the same numbers here as there.
"""

from __future__ import annotations

import math

from twin.geometry import Pose3

Rigid = tuple[float, float, float, float, float, float, float]
"""x, y, z [m], then the quaternion w, x, y, z."""
IDENTITY: Rigid = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def rigid(pose: Pose3) -> Rigid:
    """Return a pose as numbers."""
    x, y, z = pose.xyz.tolist()
    w, i, j, k = pose.quat_wxyz.tolist()
    return x, y, z, w, i, j, k


def compose(a: Rigid, b: Rigid) -> Rigid:
    """Return T_a_b · T_b_c = T_a_c."""
    ax, ay, az, aw, ai, aj, ak = a
    bx, by, bz, bw, bi, bj, bk = b
    along, scale = 2.0 * (ai * bx + aj * by + ak * bz), aw * aw - ai * ai - aj * aj - ak * ak
    double = 2.0 * aw
    return (
        ax + scale * bx + along * ai + double * (aj * bz - ak * by),
        ay + scale * by + along * aj + double * (ak * bx - ai * bz),
        az + scale * bz + along * ak + double * (ai * by - aj * bx),
        aw * bw - ai * bi - aj * bj - ak * bk,
        aw * bi + ai * bw + aj * bk - ak * bj,
        aw * bj - ai * bk + aj * bw + ak * bi,
        aw * bk + ai * bj - aj * bi + ak * bw,
    )


def inverse(a: Rigid) -> Rigid:
    """Return T_b_a of T_a_b."""
    x, y, z, w, i, j, k = a
    tx, ty, tz, *_ = compose((0.0, 0.0, 0.0, w, -i, -j, -k), (x, y, z, 1.0, 0.0, 0.0, 0.0))
    return -tx, -ty, -tz, w, -i, -j, -k


def interpolate(a: Rigid, b: Rigid, ratio: float) -> Rigid:
    """Interpolate linearly in translation and along the shorter great circle in rotation."""
    ax, ay, az, aw, ai, aj, ak = a
    bx, by, bz, bw, bi, bj, bk = b
    rest = 1.0 - ratio
    x, y, z = rest * ax + ratio * bx, rest * ay + ratio * by, rest * az + ratio * bz
    # In tf2's order of adding: of rotations that are nearly the same, the last bit decides.
    dot = ai * bi + aj * bj + ak * bk + aw * bw
    length2 = (ai * ai + aj * aj + ak * ak + aw * aw) * (bi * bi + bj * bj + bk * bk + bw * bw)
    angle = math.acos(min(1.0, abs(dot) / math.sqrt(length2)))
    if angle == 0.0:
        return x, y, z, aw, ai, aj, ak
    sine = math.sin(angle)
    wa, wb = math.sin(rest * angle) / sine, math.sin(ratio * angle) / sine
    if dot < 0.0:
        wb = -wb
    return x, y, z, wa * aw + wb * bw, wa * ai + wb * bi, wa * aj + wb * bj, wa * ak + wb * bk


def normalized(a: Rigid) -> Rigid:
    """Return the same motion with a unit quaternion."""
    x, y, z, w, i, j, k = a
    norm = math.sqrt(w * w + i * i + j * j + k * k)
    return x, y, z, w / norm, i / norm, j / norm, k / norm


def as_from_matrix(a: Rigid) -> Rigid:
    """Return the same motion with the unit quaternion that tf2 reads out of a rotation matrix.

    Of q and -q it is the one whose w, or the largest other component if w² <= 1/4, is positive.
    """
    x, y, z, w, i, j, k = normalized(a)
    leading = w if w * w > 0.25 else max((i, j, k), key=abs)
    return (x, y, z, w, i, j, k) if leading >= 0.0 else (x, y, z, -w, -i, -j, -k)
