"""Parameters of the planners, and of what they plan on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from twin.geometry import Array
from twin.parameters import Fraction, Interval, Le, Metres, Nav2, NotNegative, Seconds

Tolerance = Annotated[Metres, Interval(ge=0.0, le=10.0)]
"""Every cell within it is looked at."""
Weight = Annotated[float, Interval(ge=0.0, le=1000.0)]


@dataclass(frozen=True, kw_only=True)
class PlannerConfig:
    """Parameters of the 8-connected planner; names are those of Nav2's NavFn and Smac 2-D planners."""

    any_angle: ClassVar[bool] = False

    tolerance: Tolerance = 0.5
    """If the goal cannot be reached, how far from it the path may end."""
    allow_unknown: bool = True
    """Whether a path may cross unknown cells; they cost as much as the most expensive free cell."""
    cost_factor: Weight = 3.0
    """A metre at cost 252 counts as 1 + cost_factor metres of free space."""
    escape_factor: Annotated[float, Interval(ge=1.0, le=1000.0)] = 20.0
    """A metre inside the inscribed zone (253), out of which a start may escape, counts as so many."""

    def price(self, level: Array) -> Array:
        """Return what a metre costs at a share of the highest cost, 0 free ... 1 (252)."""
        return 1.0 + self.cost_factor * level


@dataclass(frozen=True, kw_only=True)
class ThetaStarConfig:
    """Parameters of the any-angle planner; names are those of nav2_theta_star_planner."""

    any_angle: ClassVar[bool] = True

    tolerance: Tolerance = 0.5
    """If the goal cannot be reached, how far from it the path may end."""
    allow_unknown: bool = True
    """Whether a path may cross unknown cells; they cost as much as the most expensive free cell."""
    w_euc_cost: Annotated[float, Interval(ge=0.001, le=1000.0)] = 1.0
    """Weight of a path's length."""
    w_traversal_cost: Weight = 2.0
    """Weight of the squared costs under it."""
    escape_factor: Annotated[float, Interval(ge=1.0, le=1000.0)] = 20.0
    """A metre inside the inscribed zone (253), out of which a start may escape, counts as so many."""

    def price(self, level: Array) -> Array:
        """Return what a metre costs at a share of the highest cost, 0 free ... 1 (252)."""
        return 1.0 + self.w_traversal_cost / self.w_euc_cost * level**2


_ENDLESS = 1_000_000_000
"""Poses of a search that Nav2 does not limit."""


def _unlimited(value: Any) -> Any:
    return _ENDLESS if type(value) is int and value <= 0 else value


Penalty = Annotated[float, Interval(ge=1.0, le=1000.0)]


@dataclass(frozen=True, kw_only=True)
class HybridConfig:
    """Parameters of the planner; names and defaults are those of nav2_smac_planner's SmacPlannerHybrid."""

    motion_model_for_search: Literal["DUBIN", "REEDS_SHEPP"] = "DUBIN"
    """Whether the robot only drives forwards, or backwards too."""
    minimum_turning_radius: Annotated[Metres, Interval(gt=0.0, le=100.0)] = 0.4
    """Of the robot."""
    tolerance: Tolerance = 0.25
    """If the goal is occupied, how far from it the path may end."""
    allow_unknown: bool = True
    """Whether a path may cross unknown cells; they cost as much as the most expensive free cell."""
    angle_quantization_bins: Annotated[int, Interval(ge=4, le=720)] = 72
    """Headings that are told apart."""
    analytic_expansion_ratio: Annotated[float, Interval(ge=0.01, le=1000.0)] = 3.5
    """How often a curve straight to the goal is tried."""
    analytic_expansion_max_length: Annotated[Metres, Interval(gt=0.0, le=1000.0)] = 3.0
    """It is no longer than this; 4 to 5 turning radii at least."""
    reverse_penalty: Penalty = 2.0
    """What a metre backwards counts."""
    change_penalty: Weight = 0.0
    """What is added where a turn to one side follows one to the other."""
    non_straight_penalty: Penalty = 1.2
    """What a metre of a turn counts."""
    cost_penalty: Weight = 2.0
    """A metre at cost 252 counts as 1 + cost_penalty metres of free space."""
    max_iterations: Annotated[int, Interval(ge=1, le=_ENDLESS), Nav2(read=_unlimited)] = 1_000_000
    """Poses that are expanded at most."""
    smooth_path: bool = True
    """Whether parts of the path give way to single curves where those are cheaper."""


@dataclass(frozen=True, kw_only=True)
class CommitmentConfig:
    """How strongly the last path binds; ours, Nav2 has nothing like it."""

    commitment_cost: Annotated[int, Interval(ge=0, le=252)] = 0
    """Added to the cost of each free cell off the last path, up to the dearest one; 0 switches this off."""
    commitment_width: Annotated[Metres, Interval(gt=0.0, le=5.0)] = 0.4
    """To each side of the last path that counts as on it."""


@dataclass(frozen=True, kw_only=True)
class GoalAccessConfig:
    """How long an occupied goal is hoped for."""

    goal_near: Annotated[Metres, NotNegative] = 3.0
    """From here on it matters whether the goal is free: what is seen there from afar will have moved."""
    goal_patience: Annotated[Seconds, NotNegative] = 4.0
    """How long something may be on the goal when the robot is near, until it is given up."""
    goal_surroundings: Annotated[Metres, NotNegative, Le(100.0)] = 1.2
    """How far around an occupied goal only what the map shows is planned around."""


Refinements = Annotated[int, Interval(ge=0, le=10)]


@dataclass(frozen=True, kw_only=True)
class SmootherConfig:
    """Parameters of the smoother; names and defaults are those of nav2_smoother's SimpleSmoother."""

    w_data: Annotated[float, Fraction] = 0.2
    """Pull towards the planned path."""
    w_smooth: Annotated[float, Interval(ge=0.0, le=0.5)] = 0.3
    """Pull towards the middle of the neighbours; a stronger one than 0.5 leaps over it."""
    tolerance: Annotated[Metres, NotNegative] = 1e-6
    """Stop when a sweep moves all points together by less."""
    max_its: Annotated[int, Interval(ge=1, le=5000)] = 1000
    """Stop after so many sweeps."""
    refinement_num: Refinements = 2
    """How often the result is smoothed again."""


@dataclass(frozen=True, kw_only=True)
class SavitzkyGolayConfig:
    """Parameters of the filter; names and defaults are those of nav2_smoother's SavitzkyGolaySmoother."""

    refinement_num: Refinements = 2
    """How often the result is filtered again."""
    do_refinement: bool = True
    """Whether it is."""
