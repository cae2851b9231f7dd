"""Parameters of Monte Carlo localisation."""

from __future__ import annotations

from dataclasses import dataclass

LASER_MODELS = ("likelihood_field", "likelihood_field_prob", "beam")
MOTION_MODELS = ("nav2_amcl::DifferentialMotionModel", "nav2_amcl::OmniMotionModel")


@dataclass(frozen=True, kw_only=True)
class AmclConfig:
    """Parameters; names are those of nav2_amcl. Where a default is not Nav2's, its text says why.

    Raises:
        ValueError: a model is unknown, or min_particles is more than max_particles.
    """

    alpha1: float = 0.01
    """Turning noise per turn: a variance ratio. Nav2's 0.2 is for drives that are wrong by 45 %."""
    alpha2: float = 0.01
    """Turning noise per metre; Nav2: 0.2."""
    alpha3: float = 0.01
    """Driving noise per metre; Nav2: 0.2."""
    alpha4: float = 0.01
    """Driving noise per turn; Nav2: 0.2."""
    alpha5: float = 0.01
    """Sideways noise per metre, of the omnidirectional model only; Nav2: 0.2."""
    robot_model_type: str = MOTION_MODELS[0]
    """`nav2_amcl::DifferentialMotionModel` or `nav2_amcl::OmniMotionModel`."""
    min_particles: int = 500
    max_particles: int = 2000
    pf_err: float = 0.05
    pf_z: float = 0.99
    laser_model_type: str = LASER_MODELS[0]
    """`likelihood_field`, `likelihood_field_prob` (the same with beam skipping) or `beam`."""
    max_beams: int = 60
    sigma_hit: float = 0.1
    """Largest standard deviation of a hit; a narrower one is learnt from the scans [m]. Nav2: 0.2."""
    z_hit: float = 0.5
    z_rand: float = 0.5
    z_max: float = 0.05
    """Of the beam model only, as are `z_short` and `lambda_short`."""
    z_short: float = 0.05
    lambda_short: float = 0.1
    """[1/m]"""
    laser_likelihood_max_dist: float = 2.0
    """[m]"""
    laser_min_range: float = -1.0
    """Shorter readings are not used [m]; -1: the lidar's own least range."""
    laser_max_range: float = 100.0
    """Readings of this and more saw nothing [m]; -1: the lidar's own range."""
    do_beamskip: bool = False
    """Whether `likelihood_field_prob` leaves out beams that most particles cannot explain."""
    beam_skip_distance: float = 0.5
    """A beam that ends farther from every surface is not explained by a particle [m]."""
    beam_skip_threshold: float = 0.3
    """Least share of the particles that must explain a beam."""
    beam_skip_error_threshold: float = 0.9
    """If a larger share of the beams would be left out, none is: the belief is what is wrong."""
    beam_weight: float = 0.5
    """Exponent of a beam's likelihood until it is learnt: beams on a surface share its fault on the map."""
    update_min_d: float = 0.25
    """[m]"""
    update_min_a: float = 0.2
    """[rad]"""
    resample_interval: int = 1
    recovery_alpha_slow: float = 0.001
    """Gain of the long-term average of the fit; 0 never draws fresh particles. Nav2: 0, its advice 0.001."""
    recovery_alpha_fast: float = 0.1
    """Gain of the recent average of the fit. Nav2: 0, its advice 0.1."""
    random_seed: int = -1
    """Of the filter's random numbers; -1: the scenario's seed."""
    effective_share: float = 0.1
    """A scan is taken in by stages of which each leaves at least this share of the particles effective."""
    global_particles: int = 50_000
    """How many poses a global localisation starts from."""

    def __post_init__(self) -> None:
        for name, known in (("laser_model_type", LASER_MODELS), ("robot_model_type", MOTION_MODELS)):
            if (value := getattr(self, name)) not in known:
                raise ValueError(f"amcl: {name} is '{value}'; valid are {', '.join(known)}")
        if self.min_particles > self.max_particles:
            raise ValueError(
                f"amcl: min_particles is {self.min_particles}, more than max_particles, {self.max_particles}"
            )
