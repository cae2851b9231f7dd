"""Parameters of Monte Carlo localisation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from twin.parameters import Fraction, Ge, Interval, Le, Metres, Nav2, NotNegative, PerMetre, Positive, Radians
from twin.parameters.forms import renamed

LaserModelType = Literal["likelihood_field", "likelihood_field_prob", "beam"]
MotionModelType = Literal["nav2_amcl::DifferentialMotionModel", "nav2_amcl::OmniMotionModel"]
_UNTIL_GALACTIC = Nav2(
    read=renamed(
        differential="nav2_amcl::DifferentialMotionModel", omnidirectional="nav2_amcl::OmniMotionModel"
    )
)

Alpha = Annotated[float, NotNegative, Le(100.0)]
"""A ratio of variances."""


@dataclass(frozen=True, kw_only=True)
class AmclConfig:
    """Parameters; names are those of nav2_amcl. Where a default is not Nav2's, its text says why.

    Raises:
        ValueError: min_particles is more than max_particles.
    """

    alpha1: Alpha = 0.01
    """Turning noise per turn: a variance ratio. Nav2's 0.2 is for drives that are wrong by 45 %."""
    alpha2: Alpha = 0.01
    """Turning noise per metre; Nav2: 0.2."""
    alpha3: Alpha = 0.01
    """Driving noise per metre; Nav2: 0.2."""
    alpha4: Alpha = 0.01
    """Driving noise per turn; Nav2: 0.2."""
    alpha5: Alpha = 0.01
    """Sideways noise per metre, of the omnidirectional model only; Nav2: 0.2."""
    robot_model_type: Annotated[MotionModelType, _UNTIL_GALACTIC] = "nav2_amcl::DifferentialMotionModel"
    """How odometry is wrong: of a drive that cannot, or that can go sideways."""
    min_particles: Annotated[int, Interval(ge=1, le=100_000)] = 500
    """Fewest particles."""
    max_particles: Annotated[int, Interval(ge=1, le=100_000)] = 2000
    """Most particles."""
    pf_err: Annotated[float, Interval(ge=0.001, le=1.0)] = 0.05
    """Largest error between the belief and its particles (KLD sampling) ..."""
    pf_z: Annotated[float, Interval(gt=0.0, le=10.0)] = 0.99
    """... at this quantile of the normal distribution."""
    laser_model_type: LaserModelType = "likelihood_field"
    """How scans are compared with the map; `likelihood_field_prob` can skip beams."""
    max_beams: Annotated[int, Interval(ge=1, le=10_000)] = 60
    """Beams of a scan that are compared with the map."""
    sigma_hit: Annotated[Metres, Interval(ge=0.001, le=10.0)] = 0.1
    """Largest standard deviation of a hit; a narrower one is learnt from the scans. Nav2: 0.2."""
    z_hit: Annotated[float, Fraction] = 0.5
    """Weight of hits."""
    z_rand: Annotated[float, Fraction] = 0.5
    """Weight of random readings."""
    z_max: Annotated[float, Fraction] = 0.05
    """Weight of readings that saw nothing (beam model)."""
    z_short: Annotated[float, Fraction] = 0.05
    """Weight of readings that something unknown cut short (beam model)."""
    lambda_short: Annotated[PerMetre, Positive, Le(1000.0)] = 0.1
    """Decay of those over the range (beam model)."""
    laser_likelihood_max_dist: Annotated[Metres, Interval(ge=0.01, le=100.0)] = 2.0
    """Distance beyond which a beam says nothing."""
    laser_min_range: Annotated[Metres, Ge(-1.0)] = -1.0
    """Shorter readings are not used; -1: the lidar's own least range."""
    laser_max_range: Annotated[Metres, Ge(-1.0)] = 100.0
    """Readings of this and more saw nothing; -1: the lidar's own range."""
    do_beamskip: bool = False
    """Whether `likelihood_field_prob` leaves out beams that most particles cannot explain."""
    beam_skip_distance: Annotated[Metres, Positive] = 0.5
    """A beam that ends farther from every surface is not explained by a particle."""
    beam_skip_threshold: Annotated[float, Fraction] = 0.3
    """Least share of the particles that must explain a beam."""
    beam_skip_error_threshold: Annotated[float, Fraction] = 0.9
    """If a larger share of the beams would be left out, none is: the belief is what is wrong."""
    beam_weight: Annotated[float, Positive, Le(10.0)] = 0.5
    """Exponent of a beam's likelihood until it is learnt: beams on a surface share its fault on the map; Nav2
    has none."""
    update_min_d: Annotated[Metres, NotNegative] = 0.25
    """Translation before the next update."""
    update_min_a: Annotated[Radians, NotNegative] = 0.2
    """Rotation before the next update."""
    resample_interval: Annotated[int, Interval(ge=1, le=1000)] = 1
    """Updates between two resamplings."""
    recovery_alpha_slow: Annotated[float, Fraction] = 0.001
    """Gain of the long-term average of the fit; 0 never looks for a robot that was carried away. Nav2: 0, its
    advice 0.001."""
    recovery_alpha_fast: Annotated[float, Fraction] = 0.1
    """Gain of the recent average of the fit. Nav2: 0, its advice 0.1."""
    random_seed: Annotated[int, Interval(ge=-1, le=2**63 - 1)] = -1
    """Of the filter's random numbers; -1: the scenario's seed."""
    effective_share: Annotated[float, Interval(gt=0.0, le=1.0)] = 0.1
    """A scan is taken in by stages of which each leaves at least this share of the particles effective; Nav2
    has no stages."""
    global_particles: Annotated[int, Interval(ge=1, le=500_000)] = 50_000
    """How many poses a global localisation starts from; Nav2: max_particles."""

    def __post_init__(self) -> None:
        if self.min_particles > self.max_particles:
            raise ValueError(
                f"min_particles is {self.min_particles}, more than max_particles, {self.max_particles}"
            )
