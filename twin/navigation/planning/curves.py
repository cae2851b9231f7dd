"""Shortest curves of bounded curvature: Dubins (1957), forwards only, and Reeds and Shepp (1990).

A word is up to five pieces, each an arc to the left (1), straight (0) or an arc to the right (-1); a negative
length is driven backwards. Lengths are in turning radii, so an arc's is its angle. Formula numbers are those
of Reeds and Shepp, "Optimal paths for a car that goes both forwards and backwards", section 8.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation._jit import jit

_HALF_PI = 0.5 * math.pi
_ZERO = 1e-10
_POINT = 1e-6
"""A straight piece that is shorter has no direction but that of rounding."""

Turns = NDArray[np.int64]


@jit
def _signed(angle: float) -> float:
    """Return an angle in [-pi, pi); what is zero but for rounding is zero."""
    wrapped = (angle + math.pi) % (2.0 * math.pi) - math.pi
    return 0.0 if abs(wrapped) < _ZERO else wrapped


@jit
def _forward(angle: float) -> float:
    """Return an angle in [0, 2 pi); what is zero but for rounding is zero."""
    wrapped = angle % (2.0 * math.pi)
    return 0.0 if 2.0 * math.pi - wrapped < _ZERO or wrapped < _ZERO else wrapped


@jit
def _tau_omega(u: float, v: float, xi: float, eta: float, phi: float) -> tuple[float, float]:
    """Return the first and last arcs of the words of four arcs."""
    delta = _signed(u - v)
    a = math.sin(u) - math.sin(delta)
    b = math.cos(u) - math.cos(delta) - 1.0
    t = math.atan2(eta * a - xi * b, xi * a + eta * b)
    if 2.0 * (math.cos(delta) - math.cos(v) - math.cos(u)) + 3.0 < 0.0:
        t += math.pi
    t = _signed(t)
    return t, _signed(t - u + v - phi)


@jit
def _dubins(kind: int, x: float, y: float, phi: float) -> tuple[bool, float, float, float]:
    """Return whether a forward word that begins to the left reaches the pose, and its three lengths."""
    sine, cosine = math.sin(phi), math.cos(phi)
    if kind == 1:  # left, straight, right
        xi, eta = x + sine, y - 1.0 - cosine
        square = xi * xi + eta * eta
        if square < 4.0 - _ZERO:
            return False, 0.0, 0.0, 0.0
        u = math.sqrt(max(0.0, square - 4.0))
        t = _forward(math.atan2(eta, xi) + math.atan2(2.0, u))
        return True, t, u, _forward(t - phi)
    xi, eta = x - sine, y - 1.0 + cosine
    radius, theta = math.hypot(xi, eta), math.atan2(eta, xi)
    if kind == 0:  # left, straight, left
        t = _forward(theta if radius > _POINT else phi)
        return True, t, radius, _forward(phi - t)
    if radius > 4.0 + _ZERO:
        return False, 0.0, 0.0, 0.0
    # left, right, left: round the far side of the middle circle
    back = 2.0 * math.asin(min(1.0, 0.25 * radius))
    t = _forward(theta - 0.5 * back + math.pi)
    return True, t, 2.0 * math.pi - back, _forward(phi - t - back)


@jit
def _reeds_shepp(kind: int, x: float, y: float, phi: float) -> tuple[bool, float, float, float]:
    """Return whether the word of a formula, left first and forwards, reaches the pose, and its t, u, v."""
    sine, cosine = math.sin(phi), math.cos(phi)
    if kind in (0, 2, 5):
        xi, eta = x - sine, y - 1.0 + cosine
    else:
        xi, eta = x + sine, y - 1.0 - cosine
    square = xi * xi + eta * eta
    radius, theta = math.sqrt(square), math.atan2(eta, xi)
    t, u, v = -1.0, 0.0, 0.0
    if kind == 0:  # 8.1: L+ S+ L+
        t, u = _signed(theta), radius
        v = _signed(phi - t)
        return t >= 0.0 and v >= 0.0, t, u, v
    if kind == 1 and square >= 4.0 - _ZERO:  # 8.2: L+ S+ R+
        u = math.sqrt(max(0.0, square - 4.0))
        t = _signed(theta + math.atan2(2.0, u))
        v = _signed(t - phi)
        return t >= 0.0 and v >= 0.0, t, u, v
    if kind == 2 and radius <= 4.0 + _ZERO:  # 8.3 and 8.4: L+ R- L
        u = -2.0 * math.asin(min(1.0, 0.25 * radius))
        t = _signed(theta + 0.5 * u + math.pi)
        v = _signed(phi - t + u)
        return t >= 0.0, t, u, v
    if kind == 3 and radius <= 2.0 + _ZERO:  # 8.7: L+ R+ L- R-, the middle ones alike
        u = math.acos(min(1.0, 0.25 * (2.0 + radius)))
        t, v = _tau_omega(u, -u, xi, eta, phi)
        return t >= 0.0 and v <= 0.0, t, u, v
    if kind == 4 and 0.0 <= (20.0 - square) / 16.0 <= 1.0:  # 8.8: L+ R- L- R+, the middle ones alike
        u = -math.acos((20.0 - square) / 16.0)
        t, v = _tau_omega(u, u, xi, eta, phi)
        return t >= 0.0 and v >= 0.0, t, u, v
    if kind == 5 and radius >= 2.0 - _ZERO:  # 8.9: L+ R-90 S- L-
        r = math.sqrt(max(0.0, square - 4.0))
        t = _signed(theta + math.atan2(r, -2.0))
        u, v = 2.0 - r, _signed(phi - _HALF_PI - t)
        return t >= 0.0 and u <= 0.0 and v <= 0.0, t, u, v
    if kind == 6 and radius >= 2.0 - _ZERO:  # 8.10: L+ R-90 S- R-
        t = math.atan2(xi, -eta)
        u, v = 2.0 - radius, _signed(t + _HALF_PI - phi)
        return t >= 0.0 and u <= 0.0 and v <= 0.0, t, u, v
    if kind == 7 and radius >= 2.0 - _ZERO:  # 8.11: L+ R-90 S- L-90 R+
        u = 4.0 - math.sqrt(max(0.0, square - 4.0))
        t = _signed(math.atan2((4.0 - u) * xi - 2.0 * eta, -2.0 * xi + (u - 4.0) * eta))
        v = _signed(t - phi)
        return t >= 0.0 and u <= 0.0 and v >= 0.0, t, u, v
    return False, t, u, v


@jit
def _total(kind: int, t: float, u: float, v: float) -> float:
    """Return the length of a word."""
    middle = abs(u)
    if kind in (3, 4):
        middle *= 2.0
    elif kind in (5, 6):
        middle += _HALF_PI
    elif kind == 7:
        middle += math.pi
    return abs(t) + middle + abs(v)


@jit
def _spell(kind: int, t: float, u: float, v: float, backwards: bool, turns: Turns, lengths: Array) -> int:
    """Write the pieces of a word, left first; return how many. `backwards` is the order of the pieces."""
    count = 3
    if kind == 0:
        turns[:3] = (1, 0, 1)
    elif kind == 1:
        turns[:3] = (1, 0, -1)
    elif kind == 2:
        turns[:3] = (1, -1, 1)
    elif kind in (3, 4):
        turns[:4], count = (1, -1, 1, -1), 4
    elif kind in (5, 6):
        turns[:4], count = (1, -1, 0, 1 if kind == 5 else -1), 4
    else:
        turns[:5], count = (1, -1, 0, 1, -1), 5
    if count == 3:
        lengths[:3] = (t, u, v)
    elif kind == 3:
        lengths[:4] = (t, u, -u, v)
    elif kind == 4:
        lengths[:4] = (t, u, u, v)
    elif count == 4:
        lengths[:4] = (t, -_HALF_PI, u, v)
    else:
        lengths[:5] = (t, -_HALF_PI, u, -_HALF_PI, v)
    if backwards:
        turns[:count] = turns[:count][::-1].copy()
        lengths[:count] = lengths[:count][::-1].copy()
    return count


@jit
def shortest_curve(
    x: float, y: float, phi: float, reverse: bool, turns: Turns, lengths: Array
) -> tuple[float, int]:
    """Find the shortest word from (0, 0, 0) to (x, y, phi); all lengths in turning radii.

    Args:
        x: Ahead.
        y: To the left.
        phi: Heading [rad].
        reverse: Reeds-Shepp, which may drive backwards, instead of Dubins.
        turns: Written, shape (5,): 1 left, 0 straight, -1 right.
        lengths: Written, shape (5,): of each piece, negative backwards.

    Returns:
        Its length, and how many pieces it has.
    """
    best, best_kind, best_flip, best_mirror, best_back = math.inf, 0, 1.0, 1, False
    best_t, best_u, best_v = 0.0, 0.0, 0.0
    away_x = x * math.cos(phi) + y * math.sin(phi)
    away_y = x * math.sin(phi) - y * math.cos(phi)
    for kind in range(8 if reverse else 3):
        # Words that are not their own reverse are tried in reverse order too.
        for order in range(2 if reverse and kind in (2, 5, 6) else 1):
            px, py = (away_x, away_y) if order == 1 else (x, y)
            for flip in (1.0, -1.0) if reverse else (1.0, 1.0):
                for mirror in (1, -1):
                    if reverse:
                        found, t, u, v = _reeds_shepp(kind, flip * px, mirror * py, flip * mirror * phi)
                    else:
                        found, t, u, v = _dubins(kind, px, mirror * py, mirror * phi)
                    if not found:
                        continue
                    total = _total(kind, t, u, v)
                    if total < best - _ZERO:
                        best, best_kind, best_flip, best_mirror = total, kind, flip, mirror
                        best_back, best_t, best_u, best_v = order == 1, t, u, v
    count = _spell(best_kind, best_t, best_u, best_v, best_back, turns, lengths)
    for i in range(count):
        turns[i] *= best_mirror
        lengths[i] *= best_flip
    return best, count


@jit
def advance(
    x: float, y: float, yaw: float, turn: int, length: float, radius: float
) -> tuple[float, float, float]:
    """Return the pose after one piece of `length` [radii], negative backwards, at a turning radius [m]."""
    if turn == 0:
        return x + radius * length * math.cos(yaw), y + radius * length * math.sin(yaw), yaw
    end = yaw + turn * length
    r = radius * turn
    return x + r * (math.sin(end) - math.sin(yaw)), y - r * (math.cos(end) - math.cos(yaw)), end
