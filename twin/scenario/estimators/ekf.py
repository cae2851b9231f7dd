"""The Kalman filter of odometry."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated

from pydantic import AfterValidator

from twin.navigation.localisation.ekf import EkfConfig
from twin.nodes.navigation.localisation.ekf_config import SOURCE, EkfNodeConfig, EkfSource
from twin.scenario.estimators import Checked
from twin.scenario.parameter_group import ParameterGroup, keys_of


@keys_of(EkfSource)
class EkfSourceParameters(ParameterGroup):
    """A source of `/ekf_filter_node`; of its keys those count that robot_localization has for its kind."""


def _source_name(name: str) -> str:
    if not re.fullmatch(SOURCE, name):
        raise ValueError("a source is called odom0, pose0, twist0, imu0, odom1...")
    return name


SourceName = Annotated[str, AfterValidator(_source_name)]


@keys_of(EkfNodeConfig)
class EkfParameters(Checked):
    """Parameters of `/ekf_filter_node`."""

    among = EkfConfig
    sources: Mapping[SourceName, EkfSourceParameters] = {}
    """What it listens to besides, or instead of, `odom0` (wheels) and `imu0`."""
