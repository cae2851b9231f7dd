"""What a scenario may override of the global planner; names are those of Nav2's plugins."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from twin.parameters import Metres, NotNegative, Positive, Seconds
from twin.scenario.parameter_group import ParameterGroup

_AtLeastOne = Field(ge=1.0)

_SERVER = frozenset(
    {
        "plugin",
        "compute_alternatives",
        "tolerance",
        "allow_unknown",
        "commitment_cost",
        "commitment_width",
        "goal_patience",
    }
)
_KEYS = {
    "grid_based": frozenset({"cost_factor"}),
    "theta_star": frozenset({"w_euc_cost", "w_traversal_cost"}),
    "smac_hybrid": frozenset(
        {
            "motion_model_for_search",
            "minimum_turning_radius",
            "angle_quantization_bins",
            "analytic_expansion_ratio",
            "analytic_expansion_max_length",
            "reverse_penalty",
            "change_penalty",
            "non_straight_penalty",
            "cost_penalty",
            "max_iterations",
            "smooth_path",
        }
    ),
}


class PlannerParameters(ParameterGroup):
    """Parameters of `/planner_server`: which planner `GridBased` is, and that planner's own."""

    plugin: Literal["grid_based", "theta_star", "smac_hybrid"] = "theta_star"
    """8-connected A*; any-angle Theta*; Hybrid-A* for robots with a turning circle."""
    tolerance: Annotated[Metres, NotNegative] | None = None
    """How far from the requested goal a plan may end [m]."""
    allow_unknown: bool | None = None
    """Whether a plan may cross unknown cells."""
    compute_alternatives: Annotated[int, NotNegative] | None = None
    """How many other ways are tried when a goal is asked for again from the same place."""
    commitment_cost: Annotated[int, Field(ge=0, le=252)] | None = None
    """Added to the cost of each cell off the last path, so that routes are not changed lightly."""
    commitment_width: Annotated[Metres, Positive] | None = None
    """To each side of the last path that counts as on it [m]."""
    goal_patience: Annotated[Seconds, NotNegative] | None = None
    """How long somebody may stand on the goal when the robot is near, until it is given up [s]."""
    cost_factor: Annotated[float, NotNegative] | None = None
    """`grid_based`: a metre at cost 252 counts as 1 + cost_factor metres of free space."""
    w_euc_cost: Annotated[float, Positive] | None = None
    """`theta_star`: weight of a path's length."""
    w_traversal_cost: Annotated[float, NotNegative] | None = None
    """`theta_star`: weight of the squared costs under it."""
    motion_model_for_search: Literal["DUBIN", "REEDS_SHEPP"] | None = None
    """`smac_hybrid`: only forwards, or backwards too."""
    minimum_turning_radius: Annotated[Metres, Positive] | None = None
    """`smac_hybrid`: of the robot [m]."""
    angle_quantization_bins: Annotated[int, Field(ge=4, le=720)] | None = None
    """`smac_hybrid`: headings that are told apart."""
    analytic_expansion_ratio: Annotated[float, Positive] | None = None
    """`smac_hybrid`: how often a curve straight to the goal is tried."""
    analytic_expansion_max_length: Annotated[Metres, Positive] | None = None
    """`smac_hybrid`: it is no longer than this [m]."""
    reverse_penalty: Annotated[float, _AtLeastOne] | None = None
    """`smac_hybrid`: what a metre backwards counts."""
    change_penalty: Annotated[float, NotNegative] | None = None
    """`smac_hybrid`: what is added where a turn follows one to the other side."""
    non_straight_penalty: Annotated[float, _AtLeastOne] | None = None
    """`smac_hybrid`: what a metre of a turn counts."""
    cost_penalty: Annotated[float, NotNegative] | None = None
    """`smac_hybrid`: a metre at cost 252 counts as 1 + cost_penalty metres of free space."""
    max_iterations: Annotated[int, Positive] | None = None
    """`smac_hybrid`: poses that are expanded at most."""
    smooth_path: bool | None = None
    """`smac_hybrid`: whether parts of the path give way to single curves where those are cheaper."""

    @model_validator(mode="after")
    def _belongs_to_the_plugin(self) -> PlannerParameters:
        valid = _SERVER | _KEYS[self.plugin]
        for name in sorted(self.model_fields_set - valid):
            others = " or ".join(plugin for plugin, keys in _KEYS.items() if name in keys)
            raise ValueError(
                f"{name} is a parameter of {others}; {self.plugin} has {', '.join(sorted(valid))}"
            )
        return self
