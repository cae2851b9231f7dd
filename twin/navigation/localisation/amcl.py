"""Adaptive Monte Carlo localisation in a known map, with nav2_amcl's conventions."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from twin.errors import MapError
from twin.geometry import Array, Pose2, wrap_angle
from twin.navigation.localisation.likelihood_field import LikelihoodField
from twin.navigation.localisation.particles import (
    best_cluster,
    bin_keys,
    kld_sample_size,
    mean_and_covariance,
    sample_motion,
    systematic_resample,
    tempered_weights,
)
from twin.navigation.maps.occupancy_map import FREE, OccupancyMap


@dataclass(frozen=True, kw_only=True)
class AmclConfig:
    """Parameters; names are those of nav2_amcl (whose alphas default to 0.2, for drives that slip more)."""

    alpha1: float = 0.05
    """Turning noise per turn."""
    alpha2: float = 0.05
    """Turning noise per metre."""
    alpha3: float = 0.05
    """Driving noise per metre."""
    alpha4: float = 0.05
    """Driving noise per turn."""
    min_particles: int = 500
    max_particles: int = 2000
    pf_err: float = 0.05
    pf_z: float = 0.99
    max_beams: int = 60
    sigma_hit: float = 0.1
    """[m]"""
    z_hit: float = 0.5
    z_rand: float = 0.5
    laser_likelihood_max_dist: float = 2.0
    """[m]"""
    laser_min_range: float = 0.0
    """[m]"""
    laser_max_range: float = 100.0
    """Readings of this and more saw nothing and are not used [m]."""
    beam_weight: float = 0.5
    """Exponent of a beam's likelihood: beams are not independent, all of them see the same map's faults."""
    update_min_d: float = 0.25
    """[m]"""
    update_min_a: float = 0.2
    """[rad]"""
    resample_interval: int = 1
    recovery_alpha_slow: float = 0.0
    recovery_alpha_fast: float = 0.0
    least_effective: float = 20.0
    """Weights are flattened while fewer particles than this would count."""
    global_particles: int = 50_000
    """How many poses `global_localisation` tries at once."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Where the robot is."""

    pose: Pose2
    """Of the base in the map frame: mean of the heaviest cluster."""
    covariance: Array
    """Of x, y, yaw, shape (3, 3)."""
    T_map_odom: Pose2
    """What to publish as the transform map -> odom."""


class Amcl:
    """A particle filter over poses in a map.

    Random numbers are Philox(seed), drawn in a fixed order: the same inputs give the same estimates.

    Raises:
        MapError: the map has no free cell.
    """

    def __init__(self, config: AmclConfig, occupancy: OccupancyMap, seed: int) -> None:
        self.config = config
        self._map = occupancy
        self._field = LikelihoodField(
            occupancy,
            sigma_hit=config.sigma_hit,
            z_hit=config.z_hit,
            z_rand=config.z_rand,
            max_dist=config.laser_likelihood_max_dist,
        )
        self._free = np.argwhere(occupancy.data == FREE)[:, ::-1]
        if not len(self._free):
            raise MapError("the map has no free cell; localisation needs at least one")
        self._random = np.random.Generator(np.random.Philox(key=seed))
        self._odom: Pose2 | None = None
        self._updates = 0
        self._w_slow = self._w_fast = 0.0
        self.particles: Array = np.zeros((0, 3))
        """Poses in the map frame, shape (n, 3)."""
        self.weights: Array = np.zeros(0)
        """Shape (n,), sum 1."""
        self.estimate: Estimate | None = None
        """The latest one."""
        self.global_localisation()

    def initialise(self, pose: Pose2, covariance: ArrayLike) -> None:
        """Start from a guess: its pose in the map frame and the covariance, shape (3, 3), of x, y, yaw."""
        spread = np.asarray(covariance, dtype=np.float64)
        values, vectors = np.linalg.eigh(spread)
        normal = self._random.standard_normal((self.config.max_particles, 3))
        particles = normal * np.sqrt(np.maximum(values, 0.0)) @ vectors.T + pose
        self._restart(particles)

    def global_localisation(self) -> None:
        """Start from no idea: poses all over the free cells (nav2's reinitialize_global_localization)."""
        self._restart(self._anywhere(self.config.global_particles))

    def update(
        self, odom: Pose2, ranges: ArrayLike, angles: ArrayLike, T_base_lidar: Pose2, *, force: bool = False
    ) -> Estimate | None:
        """Take in a scan; return a new estimate, or None if the robot has hardly moved since the last one.

        Args:
            odom: Pose of the base in the odom frame when the scan was taken.
            ranges: Shape (n,) [m]; what is not finite or out of range saw nothing.
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
            noise = self._random.standard_normal((3, len(self.particles)))
            alphas = (config.alpha1, config.alpha2, config.alpha3, config.alpha4)
            self.particles = sample_motion(self.particles, self._odom, odom, alphas, noise)
        self._odom = odom
        ends = self._beam_ends(np.asarray(ranges, dtype=np.float64), np.asarray(angles), T_base_lidar)
        if len(ends):
            self._weigh(ends)
        members = best_cluster(self.particles, self.weights)
        pose, covariance = mean_and_covariance(self.particles[members], self.weights[members])
        self.estimate = Estimate(pose=pose, covariance=covariance, T_map_odom=pose @ odom.inverse())
        self._updates += 1
        if self._updates % config.resample_interval == 0:
            self._resample(ends)
        return self.estimate

    def _restart(self, particles: Array) -> None:
        self.particles = particles
        self.weights = np.full(len(particles), 1.0 / len(particles))
        self.estimate = None
        self._odom = None
        self._updates = 0
        self._w_slow = self._w_fast = 0.0

    def _anywhere(self, count: int) -> Array:
        """Return poses uniform over the free cells and all headings, shape (count, 3)."""
        cells = self._free[self._random.integers(len(self._free), size=count)]
        place = self._random.random((count, 3))
        xy = self._map.cell_to_world(cells + place[:, :2] - 0.5)
        return np.column_stack([xy, (2.0 * place[:, 2] - 1.0) * math.pi])

    def _where_it_fits(self, count: int, ends: Array) -> Array:
        """Return poses from all over the map that explain a scan, shape (count, 3).

        Source: Lenser and Veloso, Sensor Resetting Localization, ICRA 2000; amcl draws them blindly.
        """
        candidates = self._anywhere(max(count, self.config.global_particles // 5))
        fit = self._field.log_likelihood(candidates, ends)
        weights = tempered_weights(self.config.beam_weight * fit, self.config.least_effective)
        return candidates[systematic_resample(weights, count, float(self._random.random()))]

    def _beam_ends(self, ranges: Array, angles: Array, T_base_lidar: Pose2) -> Array:
        """Return the ends of at most max_beams evenly spread beams in the base frame, shape (b, 2)."""
        config = self.config
        count = min(config.max_beams, len(ranges))
        chosen = np.linspace(0, len(ranges) - 1, count).round().astype(np.int64)
        r, a = ranges[chosen], angles[chosen]
        seen = np.isfinite(r) & (r > config.laser_min_range) & (r < config.laser_max_range)
        r, a = r[seen], a[seen]
        return T_base_lidar.apply(np.column_stack([r * np.cos(a), r * np.sin(a)]))

    def _weigh(self, ends: Array) -> None:
        fit = self._field.log_likelihood(self.particles, ends)
        per_beam = float(np.exp(fit / len(ends)) @ self.weights)
        config = self.config
        self._w_slow += config.recovery_alpha_slow * (per_beam - self._w_slow) if self._w_slow else per_beam
        self._w_fast += config.recovery_alpha_fast * (per_beam - self._w_fast) if self._w_fast else per_beam
        with np.errstate(divide="ignore"):
            prior = np.log(self.weights)
        least = min(config.least_effective, 0.5 * len(self.particles))
        self.weights = tempered_weights(prior + config.beam_weight * fit, least)

    def _resample(self, ends: Array) -> None:
        """Draw as many particles as the spread of the belief asks for (KLD sampling)."""
        config = self.config
        offset, again = self._random.random(2)
        drawn = systematic_resample(self.weights, config.max_particles, offset)
        bins = len(np.unique(bin_keys(self.particles[drawn])))
        wanted = kld_sample_size(bins, config.pf_err, config.pf_z)
        count = min(max(wanted, config.min_particles), config.max_particles)
        self.particles = self.particles[systematic_resample(self.weights, count, again)]
        self.weights = np.full(count, 1.0 / count)
        lost = max(0.0, 1.0 - self._w_fast / self._w_slow) if self._w_slow > 0.0 else 0.0
        fresh = round(lost * count)
        if fresh:
            replaced = np.linspace(0, count - 1, fresh).astype(np.int64)
            self.particles[replaced] = self._where_it_fits(fresh, ends)
            self._w_slow = self._w_fast = 0.0
