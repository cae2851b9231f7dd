"""What share of a scenario's runs is to pass, if it is run with many seeds."""

from __future__ import annotations

from typing import Annotated

from twin.parameters import Gt, Lt
from twin.strict_yaml import StrictModel

Share = Annotated[float, Gt(0.0), Lt(1.0)]


class PassRate(StrictModel):
    """A claim that a sweep judges: of all seeds at least this share passes."""

    min: Share
    """Least share of the runs that pass, over all seeds there are."""
    confidence: Share = 0.95
    """How sure a verdict is to be: at most 1 - this of all sweeps give a wrong one."""
