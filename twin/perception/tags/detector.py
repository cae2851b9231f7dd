"""Finds tags in an image, and tells where they are: OpenCV finds and reads them, edges give the corners."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose3
from twin.parameters import Interval, Metres, Positive
from twin.perception.opencv import opencv
from twin.perception.tags.families import FAMILIES, FamilyName, dictionary, modules

_PRINT = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]], np.float32)
"""Corners of a print from the top left one on, clockwise; x to the right, y down."""
_UP_AND_OUT = Pose3(np.zeros(3), np.array([0.0, 1.0, 0.0, 0.0]))
"""From y down and z into the print to y up and z out of it."""
_NOT = np.zeros(3)
_ALONG = np.linspace(0.06, 0.94, 45)
"""Where along an edge it is looked for."""
_ACROSS = np.linspace(-1.0, 1.0, 25)
"""And where across it, in shares of ..."""
_REACH, _REACH_MODULES = 3.0, 0.8
"""... so many pixels, or modules if these are smaller: other modules have edges, too."""
_ROUNDS = 2
"""How often edges are looked for, each time where the last one has them."""


@dataclass(frozen=True, kw_only=True)
class TagDetectorConfig:
    """Parameters; names are apriltag_ros's."""

    family: FamilyName = "tag36h11"
    """Which tags: AprilTag's, or one of OpenCV's dictionaries of ArUco."""
    size: Annotated[Metres, Positive] = 0.16
    """Side of the black border; apriltag_ros: 1."""
    max_hamming: Annotated[int, Interval(ge=0, le=3)] = 0
    """So many wrong modules are put right; each makes tags likelier where none is."""


@dataclass(frozen=True, kw_only=True)
class TagSight:
    """A tag in an image."""

    number: int
    """Its id."""
    hamming: int
    """How many modules were read wrong."""
    decision_margin: float
    """How far black and white are from the grey between them [grey values], as AprilTag tells it."""
    corners: Array
    """Of its black border, from the top left one of the print on, clockwise, shape (4, 2) [pixels]."""
    homography: Array
    """From the print, corners at (±1, ±1), y down, to pixels, shape (3, 3)."""
    T_camera_tag: Pose3
    """In the optical frame; x to the right of the print, y up, z out of it."""
    error: float
    """Root mean square distance of the corners from where this pose has them [pixels]."""


class TagDetector:
    """Finds tags of one family."""

    def __init__(self, config: TagDetectorConfig, sizes: Mapping[int, float] | None = None) -> None:
        """Take a family; `sizes` [m] are those of ids that differ from the config's.

        Raises:
            ScenarioError: OpenCV is not installed.
        """
        self.config = config
        self._cv2 = opencv()
        self._family = FAMILIES[config.family]
        codes = dictionary(config.family)
        options = self._cv2.aruco.DetectorParameters()
        most = codes.maxCorrectionBits
        options.errorCorrectionRate = min(config.max_hamming, most) / most if most else 0.0
        self._detector = self._cv2.aruco.ArucoDetector(codes, options)
        self._sizes = dict(sizes or {})

    def detect(self, grey: NDArray[np.uint8], matrix: Array, distortion: Array) -> list[TagSight]:
        """Return the tags of an image, by their ids.

        Args:
            grey: Shape (height, width).
            matrix: K of its CameraInfo, shape (3, 3).
            distortion: D of it, as `plumb_bob` has it.
        """
        found, numbers, _ = self._detector.detectMarkers(grey)
        if numbers is None:
            return []
        turned = [np.roll(one.reshape(4, 2), -2 * self._family.half_turns, axis=0) for one in found]
        pairs = sorted(zip(numbers.ravel().tolist(), turned, strict=True), key=lambda pair: pair[0])
        exact = grey.astype(np.float32)
        return [self._sight(exact, number, corners, matrix, distortion) for number, corners in pairs]

    def _sight(
        self, grey: NDArray[np.float32], number: int, corners: Array, matrix: Array, distortion: Array
    ) -> TagSight:
        for _ in range(_ROUNDS):
            rays = self._refined(grey, corners, matrix, distortion)
            points = np.column_stack((rays, np.ones(4)))
            corners = self._cv2.projectPoints(points, _NOT, _NOT, matrix, distortion)[0][:, 0]
        pose, error = self._pose(rays, self._sizes.get(number, self.config.size))
        homography = self._cv2.getPerspectiveTransform(_PRINT, corners.astype(np.float32))
        hamming, margin = self._read(grey, number, homography)
        return TagSight(
            number=number,
            hamming=hamming,
            decision_margin=margin,
            corners=corners,
            homography=homography,
            T_camera_tag=pose,
            error=error * float(matrix[0, 0]),
        )

    def _refined(self, grey: NDArray[np.float32], corners: Array, matrix: Array, distortion: Array) -> Array:
        """Return where lines through the edges meet, on the plane z = 1, shape (4, 2).

        The gradient across an edge tells where it is. Behind a lens it is straight on that plane only.
        """
        ends = corners.astype(np.float64)
        lines = []
        for a, b in zip(ends, np.roll(ends, -1, axis=0), strict=True):
            length = float(np.linalg.norm(b - a))
            along = (b - a) / length
            across = min(_REACH, _REACH_MODULES * length / (self._family.side + 2)) * _ACROSS
            normal = np.array([along[1], -along[0]])
            on_edge = a + _ALONG[:, None] * (b - a)
            seen = self._sampled(grey, on_edge[:, None] + across[:, None] * normal)
            slope = np.maximum(np.diff(seen, axis=1), 0.0) ** 2  # black inside, white outside
            weight = slope.sum(axis=1)
            middle = slope @ (across[:-1] + across[1:]) / np.maximum(2.0 * weight, 1e-9)
            points = on_edge + middle[:, None] * normal
            points = points[weight > 0.1 * weight.max()]
            points = self._cv2.undistortPoints(points[:, None], matrix, distortion)[:, 0]
            centre = points.mean(axis=0)
            lines.append((centre, np.linalg.svd(points - centre)[2][0]))
        return np.array([_meeting(*lines[i - 1], *lines[i]) for i in range(4)])

    def _sampled(self, grey: NDArray[np.float32], at: Array) -> Array:
        """Return grey values between pixels, shape (n, m), of points, shape (n, m, 2)."""
        cv2, maps = self._cv2, at.astype(np.float32)
        sampled = cv2.remap(grey, maps, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return sampled.astype(np.float64)

    def _pose(self, rays: Array, size: float) -> tuple[Pose3, float]:
        """Return the better one of the two poses in which a square looks like that.

        Args:
            rays: Its corners on the plane z = 1, shape (4, 2).
            size: Of its side [m].

        Returns:
            The pose, and the root mean square error of the corners on that plane.
        """
        cv2 = self._cv2
        # OpenCV does not find turns of half a turn: so the corner that looks like the top left one is it, and
        # y goes down.
        first = int(np.argmin(rays.sum(axis=1)))
        square = np.hstack((_PRINT[::-1] * size / 2.0, np.zeros((4, 1))))
        seen = np.roll(rays, -first, axis=0)[::-1].copy()
        poses = cv2.solvePnPGeneric(square, seen, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE_SQUARE)
        best = None
        for turn, shift in zip(poses[1], poses[2], strict=True):
            turn, shift = cv2.solvePnPRefineLM(square, seen, np.eye(3), None, turn, shift)
            again = cv2.projectPoints(square, turn, shift, np.eye(3), None)[0][:, 0]
            error = float(np.sqrt(((again - seen) ** 2).sum(axis=1).mean()))
            if best is None or error < best[1]:
                best = _pose_of(turn.ravel(), shift.ravel()), error
        assert best is not None
        upright = Pose3.from_xyz_rpy(rpy=(0.0, 0.0, -first * np.pi / 2.0))
        return best[0] @ upright @ _UP_AND_OUT, best[1]

    def _read(self, grey: NDArray[np.float32], number: int, homography: Array) -> tuple[int, float]:
        """Return how many modules are wrong, and how surely the others were read."""
        side = self._family.side
        middles = (2.0 * np.arange(side + 2) + 1.0) / (side + 2) - 1.0
        lattice = np.stack(np.meshgrid(middles, middles), axis=-1).astype(np.float32)
        at = self._cv2.perspectiveTransform(lattice.reshape(1, -1, 2), homography).reshape(lattice.shape)
        seen = self._sampled(grey, at)
        white = np.pad(modules(self.config.family, number), 1)
        bright, dark = seen[white].mean(), seen[~white].mean()
        wrong = ((seen > (bright + dark) / 2.0) != white)[1:-1, 1:-1]
        return int(np.count_nonzero(wrong)), float(bright - dark) / 2.0


def _meeting(p: Array, u: Array, q: Array, v: Array) -> Array:
    """Return where the lines through p along u and through q along v meet."""
    return p + u * np.linalg.solve(np.stack((u, -v), axis=1), q - p)[0]


def _pose_of(turn: Array, shift: Array) -> Pose3:
    angle = float(np.linalg.norm(turn))
    axis = turn / angle if angle else np.zeros(3)
    return Pose3(shift.copy(), np.array([np.cos(angle / 2.0), *(np.sin(angle / 2.0) * axis)]))
