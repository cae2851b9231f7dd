"""A graph of poses in the plane and its optimum: sparse Gauss-Newton on SE(2) with a robust kernel.

Grisetti et al., A tutorial on graph-based SLAM, 2010.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import SuperLU, splu

from twin.geometry import Array, Pose2
from twin.navigation._jit import jit

KERNEL = 9.0
"""Squared error [sigma^2] of a loop's edge above which it counts less and less (Cauchy's kernel)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Edge:
    """A measured pose of node `second` in the frame of node `first`."""

    first: int
    second: int
    pose: Pose2
    information: Array
    """Inverse covariance of x [m], y [m], yaw [rad] in the frame of `first`, shape (3, 3)."""
    loop: bool
    """Whether it closes a loop, and so may be wrong."""


class Marginals:
    """Covariances of the poses of a graph at one moment."""

    def __init__(self, factor: SuperLU, poses: Array) -> None:
        self._factor = factor
        self._poses = poses
        self._columns: dict[int, Array] = {}

    def __len__(self) -> int:
        return len(self._poses)

    def of(self, node: int) -> Array:
        """Return the covariance of x, y, yaw of a node in the map frame, shape (3, 3)."""
        return self._block(node, node)

    def between(self, first: int, second: int) -> Array:
        """Return the covariance, shape (3, 3), of the pose of node `second` in the frame of node `first`."""
        jacobian_i, jacobian_j = between_jacobians(self._poses[first], self._poses[second])
        cross = jacobian_i @ self._block(first, second) @ jacobian_j.T
        covariance = jacobian_i @ self.of(first) @ jacobian_i.T + jacobian_j @ self.of(second) @ jacobian_j.T
        covariance += cross + cross.T
        return 0.5 * (covariance + covariance.T)

    def _block(self, row: int, column: int) -> Array:
        if column not in self._columns:
            unit = np.zeros((3 * len(self), 3))
            unit[3 * column : 3 * column + 3] = np.eye(3)
            self._columns[column] = self._factor.solve(unit)
        return self._columns[column][3 * row : 3 * row + 3]


def between_jacobians(first: Array, second: Array) -> tuple[Array, Array]:
    """Return the derivatives, (3, 3) each, of the pose of `second` in the frame of `first` by either pose."""
    c, s = math.cos(first[2]), math.sin(first[2])
    dx, dy = second[0] - first[0], second[1] - first[1]
    by_first = np.array([[-c, -s, -s * dx + c * dy], [s, -c, -c * dx - s * dy], [0.0, 0.0, -1.0]])
    by_second = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return by_first, by_second


class PoseGraph:
    """Poses and edges between them; the first pose is fixed."""

    def __init__(self) -> None:
        self._poses = np.zeros((64, 3))
        self._count = 0
        self.edges: list[Edge] = []

    def __len__(self) -> int:
        return self._count

    @property
    def poses(self) -> Array:
        """Poses x [m], y [m], yaw [rad] of the nodes in the map frame, shape (n, 3); a view."""
        return self._poses[: self._count]

    def pose(self, node: int) -> Pose2:
        """Return the pose of a node in the map frame."""
        x, y, yaw = self._poses[node].tolist()
        return Pose2(x, y, yaw)

    def add_node(self, pose: Pose2) -> int:
        """Return the index of a new node."""
        if self._count == len(self._poses):
            self._poses = np.concatenate([self._poses, np.zeros_like(self._poses)])
        self._poses[self._count] = pose
        self._count += 1
        return self._count - 1

    def optimise(self, iterations: int = 10, kernel: float = KERNEL) -> float:
        """Move the nodes to where they explain the edges best.

        Args:
            iterations: At most so many.
            kernel: Squared error [sigma^2] above which loops count less and less; inf believes all of them.

        Returns:
            How far the node that moved most has moved [m].
        """
        before = self.poses.copy()
        edges = self.arrays()
        for _ in range(iterations):
            values, gradient = _linearise(self.poses, *edges, kernel)
            try:
                step = self._factor(edges[0], edges[1], values).solve(-gradient)
            except RuntimeError:  # singular: what was measured does not hold the nodes; leave them
                break
            self.poses[:] += step.reshape(-1, 3)
            if np.abs(step).max() < 1e-4:
                break
        self.poses[:, 2] = np.mod(self.poses[:, 2] + math.pi, 2.0 * math.pi) - math.pi
        return float(np.hypot(*(self.poses - before)[:, :2].T).max())

    def marginals(self) -> Marginals:
        """Return the covariances of the nodes as they are now."""
        edges = self.arrays()
        values, _ = _linearise(self.poses, *edges, KERNEL)
        return Marginals(self._factor(edges[0], edges[1], values), self.poses.copy())

    def squared_error(self, edge: Edge) -> float:
        """Return by how much an edge disagrees with the poses [sigma^2]."""
        difference = _error(self.pose(edge.first), self.pose(edge.second), edge.pose)
        return float(difference @ edge.information @ difference)

    def arrays(self) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Array, NDArray[np.bool_]]:
        """Return the edges: first and second nodes, poses, information, and whether they close loops."""
        edges = self.edges
        return (
            np.array([edge.first for edge in edges], dtype=np.int64),
            np.array([edge.second for edge in edges], dtype=np.int64),
            np.array([edge.pose for edge in edges], dtype=np.float64).reshape(-1, 3),
            np.array([edge.information for edge in edges], dtype=np.float64).reshape(-1, 3, 3),
            np.array([edge.loop for edge in edges], dtype=np.bool_),
        )

    def _factor(self, first: NDArray[np.int64], second: NDArray[np.int64], values: Array) -> SuperLU:
        blocks = (np.stack([first, first, second, second]), np.stack([first, second, first, second]))
        inner = np.arange(3)
        rows = 3 * blocks[0][..., None, None] + inner[:, None] + 0 * inner
        columns = 3 * blocks[1][..., None, None] + inner + 0 * inner[:, None]
        # The first pose is held where it is.
        at = tuple(np.concatenate([part.ravel(), inner]) for part in (rows, columns))
        entries = np.concatenate([values.ravel(), np.full(3, 1e12)])
        matrix = csc_matrix((entries, at), shape=(3 * self._count, 3 * self._count))
        options = {"SymmetricMode": True}
        return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)


def _error(first: Pose2, second: Pose2, measured: Pose2) -> Array:
    """Return the difference of a pose and its measurement, in the frame of `first`, shape (3,)."""
    actual = first.inverse() @ second
    turn = Pose2(0.0, 0.0, measured.yaw).inverse() @ Pose2(0.0, 0.0, actual.yaw)
    return np.array([actual.x - measured.x, actual.y - measured.y, turn.yaw])


@jit
def _linearise(
    poses: Array,
    first: NDArray[np.int64],
    second: NDArray[np.int64],
    measured: Array,
    information: Array,
    loop: NDArray[np.bool_],
    kernel: float,
) -> tuple[Array, Array]:
    """Return the blocks ii, ij, ji, jj of every edge, shape (4, m, 3, 3), and the gradient, shape (3 n,)."""
    count = first.shape[0]
    values = np.zeros((4, count, 3, 3))
    gradient = np.zeros(3 * poses.shape[0])
    jacobian_i = np.zeros((3, 3))
    jacobian_j = np.zeros((3, 3))
    error = np.zeros(3)
    weighted = np.zeros(3)
    for e in range(count):
        i, j = first[e], second[e]
        c, s = math.cos(poses[i, 2]), math.sin(poses[i, 2])
        dx, dy = poses[j, 0] - poses[i, 0], poses[j, 1] - poses[i, 1]
        error[0] = c * dx + s * dy - measured[e, 0]
        error[1] = -s * dx + c * dy - measured[e, 1]
        turn = poses[j, 2] - poses[i, 2] - measured[e, 2]
        error[2] = turn - 2.0 * math.pi * math.floor((turn + math.pi) / (2.0 * math.pi))
        jacobian_i[0, 0], jacobian_i[0, 1], jacobian_i[0, 2] = -c, -s, -s * dx + c * dy
        jacobian_i[1, 0], jacobian_i[1, 1], jacobian_i[1, 2] = s, -c, -c * dx - s * dy
        jacobian_i[2, 2] = -1.0
        jacobian_j[0, 0], jacobian_j[0, 1] = c, s
        jacobian_j[1, 0], jacobian_j[1, 1] = -s, c
        jacobian_j[2, 2] = 1.0
        square = 0.0
        for a in range(3):
            weighted[a] = 0.0
            for b in range(3):
                weighted[a] += information[e, a, b] * error[b]
            square += weighted[a] * error[a]
        weight = 1.0 / (1.0 + square / kernel) if loop[e] else 1.0
        for a in range(3):
            for b in range(3):
                to_i = to_j = 0.0
                for k in range(3):
                    to_i += information[e, b, k] * jacobian_i[k, a]
                    to_j += information[e, b, k] * jacobian_j[k, a]
                for k in range(3):
                    values[0, e, a, k] += weight * to_i * jacobian_i[b, k]
                    values[1, e, a, k] += weight * to_i * jacobian_j[b, k]
                    values[2, e, a, k] += weight * to_j * jacobian_i[b, k]
                    values[3, e, a, k] += weight * to_j * jacobian_j[b, k]
                gradient[3 * i + a] += weight * jacobian_i[b, a] * weighted[b]
                gradient[3 * j + a] += weight * jacobian_j[b, a] * weighted[b]
    return values, gradient
