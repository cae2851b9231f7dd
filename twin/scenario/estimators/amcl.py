"""Monte Carlo localisation."""

from __future__ import annotations

from twin.navigation.localisation.amcl_config import AmclConfig
from twin.scenario.estimators import Checked
from twin.scenario.parameter_group import keys_of


@keys_of(AmclConfig)
class AmclParameters(Checked):
    """Parameters of `/amcl`."""

    among = AmclConfig
