"""Mapping, and localisation in a pose graph."""

from __future__ import annotations

from twin.nodes.navigation.mapping.config import SlamNodeConfig
from twin.scenario.estimators import Checked
from twin.scenario.parameter_group import keys_of


@keys_of(SlamNodeConfig)
class SlamParameters(Checked):
    """Parameters of `/slam_toolbox`."""

    among = SlamNodeConfig
