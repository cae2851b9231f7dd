"""Adaptive Monte Carlo localisation in a known map, with nav2_amcl's conventions."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from twin.errors import MapError
from twin.geometry import Array, Pose2, wrap_angle
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.navigation.localisation.annealing import annealed
from twin.navigation.localisation.confidence import Confidence
from twin.navigation.localisation.evidence import ScanError, ScanEvidence
from twin.navigation.localisation.hit_calibration import HitCalibration
from twin.navigation.localisation.laser_models import is_converged, laser_model, without_strangers
from twin.navigation.localisation.laser_scan import Beams, chosen_beams
from twin.navigation.localisation.motion_models import sample_motion, sample_omni_motion
from twin.navigation.localisation.particles import (
    bin_keys,
    clusters,
    heaviest,
    kld_sample_size,
    mean_and_covariance,
    regularised,
    reshaped,
    systematic_resample,
)
from twin.navigation.localisation.surface_distance import SurfaceDistance
from twin.navigation.localisation.unmapped import explained_share
from twin.navigation.maps.occupancy_map import FREE, OccupancyMap

_FIT_SIGMA = 0.1
"""Distance from the nearest surface at which a beam counts as explained by 0.6 [m]."""
_BETTER = 0.25
"""By so much more of the scan must be explained elsewhere before the robot is looked for there."""
_POINT = 1e-14
"""Particles that are together like this are one point [m², rad²]."""
_ONE_FIT = 10.0
"""Where their variances are by more than this larger than those of a fit, particles see more than one."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Where the robot is."""

    pose: Pose2
    """Of the base in the map frame: mean of the heaviest cluster."""
    covariance: Array
    """Of x, y, yaw, shape (3, 3); of all particles while the robot is lost."""
    T_map_odom: Pose2
    """What to publish as the transform map -> odom."""
    fit: float
    """Share of the scan, 0 ... 1, that the map explains at this pose; nan if the scan saw nothing."""
    lost: float
    """Share of the belief, 0 ... 1, that is being drawn anew because scans do not fit; 0 if all is well."""


class Amcl:
    """A particle filter over poses in a map.

    Random numbers are Philox(seed), drawn in a fixed order: the same inputs give the same estimates.

    Raises:
        MapError: the map has no free cell.
    """

    def __init__(self, config: AmclConfig, occupancy: OccupancyMap, seed: int) -> None:
        self.config = config
        self._map = occupancy
        self._surfaces = SurfaceDistance(occupancy, max_dist=config.laser_likelihood_max_dist)
        self.hits = HitCalibration(occupancy.resolution, config.sigma_hit)
        """What was learnt about this map and lidar."""
        self.evidence = ScanEvidence(config.beam_weight, occupancy.resolution)
        """What was learnt about the faults that beams share."""
        self._model = laser_model(config, self._surfaces)
        self._free = np.argwhere(occupancy.data == FREE)[:, ::-1]
        if not len(self._free):
            raise MapError("the map has no free cell; localisation needs at least one")
        self._random = np.random.Generator(
            np.random.Philox(key=seed if config.random_seed < 0 else config.random_seed)
        )
        self.global_localisation()

    def _restart(self, particles: Array) -> None:
        self.particles = particles
        """Poses in the map frame, shape (n, 3)."""
        self.weights: Array = np.full(len(particles), 1.0 / len(particles))
        """Shape (n,), sum 1."""
        self.estimate: Estimate | None = None
        """The latest one."""
        self._odom: Pose2 | None = None
        self._updates = 0
        self._confidence = Confidence(self.config.recovery_alpha_slow, self.config.recovery_alpha_fast)

    def initialise(self, pose: Pose2, covariance: ArrayLike) -> None:
        """Start from a guess: its pose in the map frame and the covariance, shape (3, 3), of x, y, yaw."""
        spread = np.asarray(covariance, dtype=np.float64)
        values, vectors = np.linalg.eigh(spread)
        normal = self._random.standard_normal((self.config.max_particles, 3))
        self._restart(normal * np.sqrt(np.maximum(values, 0.0)) @ vectors.T + pose)

    def global_localisation(self) -> None:
        """Start from no idea: poses all over the free cells (nav2's reinitialize_global_localization)."""
        self._restart(self._anywhere(self.config.global_particles))

    def update(
        self, odom: Pose2, ranges: ArrayLike, angles: ArrayLike, T_base_lidar: Pose2, *, force: bool = False
    ) -> Estimate | None:
        """Take in a scan; return a new estimate, or None if the robot has hardly moved since the last one.

        Args:
            odom: Pose of the base in the odom frame when the scan was taken.
            ranges: Shape (n,) [m]; +inf saw nothing, nan and -inf tell nothing; empty: odometry alone.
            angles: Shape (n,), of the beams in the lidar frame [rad].
            T_base_lidar: Pose of the lidar in the base frame.
            force: Update without motion (nav2's request_nomotion_update).
        """
        config = self.config
        if self._odom is not None:
            moved = self._odom.distance(odom) >= config.update_min_d
            turned = abs(wrap_angle(odom.yaw - self._odom.yaw)) >= config.update_min_a
            if not (moved or turned or force):
                return None
            self._move(self._odom, odom)
        self._odom = odom
        beams = chosen_beams(
            ranges,
            angles,
            T_base_lidar,
            most=config.max_beams,
            min_range=config.laser_min_range,
            max_range=config.laser_max_range if config.laser_max_range > 0.0 else math.inf,
        )
        prior = self._weigh(beams) if len(beams) else None
        self.estimate = self._estimated(odom, beams, prior)
        self._updates += 1
        if self._updates % config.resample_interval == 0:
            self._resample(beams, self.estimate)
        return self.estimate

    def rebase(self, odom: Pose2) -> None:
        """Take odometry as continuing from `odom` without motion: it jumped."""
        self._odom = odom

    def _anywhere(self, count: int) -> Array:
        """Return poses uniform over the free cells and all headings, shape (count, 3)."""
        cells = self._free[self._random.integers(len(self._free), size=count)]
        place = self._random.random((count, 3))
        xy = self._map.cell_to_world(cells + place[:, :2] - 0.5)
        return np.column_stack([xy, (2.0 * place[:, 2] - 1.0) * math.pi])

    def _move(self, before: Pose2, now: Pose2) -> None:
        config = self.config
        noise = self._random.standard_normal((3, len(self.particles)))
        alphas = (config.alpha1, config.alpha2, config.alpha3, config.alpha4)
        if config.robot_model_type == "nav2_amcl::DifferentialMotionModel":
            self.particles = sample_motion(self.particles, before, now, alphas, noise)
        else:
            self.particles = sample_omni_motion(self.particles, before, now, (*alphas, config.alpha5), noise)

    def _weigh(self, beams: Beams) -> Array | None:
        """Take in a scan; return the covariance before it, None where particles were not together."""
        config = self.config
        converged = is_converged(self.particles)
        if config.do_beamskip and config.laser_model_type == "likelihood_field_prob" and converged:
            beams = without_strangers(beams, self.particles, self._surfaces, self.hits, config)
        # What was learnt about hits holds near the truth; far from it a wide model leads there.
        sigma = self.hits.sigma if converged else config.sigma_hit
        exponent = self.evidence.exponent if converged else config.beam_weight
        prior = mean_and_covariance(self.particles, self.weights)[1] if converged else None
        self.particles, self.weights = self._fitted(self.particles, self.weights, beams, sigma, exponent)
        return prior

    def _fitted(
        self, particles: Array, weights: Array, beams: Beams, sigma: float, exponent: float
    ) -> tuple[Array, Array]:
        config, depth = self.config, self.hits.depth
        return annealed(
            particles,
            weights,
            lambda poses: exponent * self._model.log_likelihood(poses, beams, depth, sigma),
            count=config.max_particles,
            effective=config.effective_share,
            random=self._random,
        )

    def _estimated(self, odom: Pose2, beams: Beams, prior: Array | None) -> Estimate:
        """Return the heaviest cluster's pose; learn from how the scan fits there.

        Args:
            odom: Pose of the base in the odom frame.
            beams: The scan.
            prior: Covariance before it, where particles were together.
        """
        cluster = clusters(self.particles)
        members = heaviest(cluster, self.weights)
        pose, covariance = mean_and_covariance(self.particles[members], self.weights[members])
        fit = math.nan
        if len(beams):
            ends = pose.apply(beams.ends)
            distances = self._surfaces.at(ends)
            shares = np.exp(-0.5 * ((distances + self.hits.depth) / _FIT_SIGMA) ** 2)
            fit = float(np.mean(shares))
            self._confidence.update(explained_share(shares, beams, pose, self._surfaces))
            error = self._learn(distances, ends, pose)
            if error is not None and prior is not None and not cluster.any():
                covariance = self._made_honest(pose, covariance, error.joined(prior))
        elif self.estimate is not None:
            # Nothing new was seen: only the doubt grows, and noise must not lead the estimate away.
            pose = self.estimate.T_map_odom @ odom
        if self._confidence.lost:
            _, covariance = mean_and_covariance(self.particles, self.weights)
        return Estimate(
            pose=pose,
            covariance=covariance,
            T_map_odom=pose @ odom.inverse(),
            fit=fit,
            lost=self._confidence.lost,
        )

    def _learn(self, distances: Array, ends: Array, pose: Pose2) -> ScanError | None:
        """Learn from a scan at the estimated pose about the map's and the lidar's faults."""
        if not self.hits.learn(distances):
            return None
        residuals = distances + self.hits.depth
        hits = np.abs(residuals) < 3.0 * self.hits.sigma
        seen = ends[hits]
        return self.evidence.learn(
            residuals[hits], self._surfaces.normals(seen), seen - np.array(pose[:2]), self.hits.sigma
        )

    def _made_honest(self, pose: Pose2, covariance: Array, honest: Array) -> Array:
        """Stretch the particles to a covariance, and return it; leave them where one fit does not tell it."""
        if np.linalg.eigvalsh(covariance)[0] < _POINT:
            return covariance
        if np.trace(np.linalg.solve(honest, covariance)) > 3.0 * _ONE_FIT:
            return covariance
        self.particles = reshaped(self.particles, pose, covariance, honest)
        return honest

    def _resample(self, beams: Beams, estimate: Estimate) -> None:
        """Draw as many particles as the spread of the belief asks for (KLD sampling)."""
        config = self.config
        likely = self.weights * config.max_particles > 0.5  # would be drawn into the largest sample
        bins = len(np.unique(bin_keys(self.particles[likely])))
        wanted = kld_sample_size(bins, config.pf_err, config.pf_z)
        count = min(max(wanted, config.min_particles), config.max_particles)
        kept = self.particles[systematic_resample(self.weights, count, float(self._random.random()))]
        noise = self._random.standard_normal((count, 3))
        self.particles = regularised(kept, clusters(kept), noise)
        self.weights = np.full(count, 1.0 / count)
        fresh = round(estimate.lost * count)
        if fresh and len(beams):
            found = self._where_it_fits(fresh, beams)
            # A map that is wrong here fits nowhere: only a clearly better place is worth a doubt.
            found = found[self._fits(found, beams) > self._fits(np.array([estimate.pose]), beams) + _BETTER]
            replaced = np.linspace(0, count - 1, len(found)).astype(np.int64)
            self.particles[replaced] = found

    def _fits(self, poses: Array, beams: Beams) -> Array:
        """Return the share of a scan that the map explains at poses, shape (n, 3) -> (n,)."""
        distances = [self._surfaces.at(Pose2(*pose).apply(beams.ends)) for pose in poses.tolist()]
        residuals = np.array(distances).reshape(len(poses), -1) + self.hits.depth
        return np.asarray(np.exp(-0.5 * (residuals / _FIT_SIGMA) ** 2).mean(axis=1))

    def _where_it_fits(self, count: int, beams: Beams) -> Array:
        """Return poses from all over the map that explain a scan, shape (count, 3).

        Source: Lenser and Veloso, Sensor Resetting Localization, ICRA 2000; amcl draws them blindly.
        """
        candidates = self._anywhere(max(count, self.config.global_particles // 5))
        even = np.full(len(candidates), 1.0 / len(candidates))
        poses, weights = self._fitted(candidates, even, beams, self.config.sigma_hit, self.config.beam_weight)
        return poses[systematic_resample(weights, count, float(self._random.random()))]
