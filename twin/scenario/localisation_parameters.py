"""What a scenario may override of `/amcl`, `/ekf_filter_node` and `/slam_toolbox`; names are theirs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, ClassVar, Self

from pydantic import AfterValidator, model_validator

from twin.navigation.localisation.amcl_config import AmclConfig
from twin.navigation.localisation.ekf import EkfConfig
from twin.nodes.navigation.localisation.ekf_config import SOURCE, EkfNodeConfig, EkfSource
from twin.nodes.navigation.mapping.config import SlamNodeConfig
from twin.parameters.placed import overridden
from twin.scenario.parameter_group import ParameterGroup, keys_of


class _Checked(ParameterGroup):
    """Parameters that must fit together, and to the defaults of a config."""

    among: ClassVar[type]

    @model_validator(mode="after")
    def _can_be(self) -> Self:
        overridden(self.among(), self.overrides())
        return self


@keys_of(AmclConfig)
class AmclParameters(_Checked):
    """Parameters of `/amcl`."""

    among = AmclConfig


@keys_of(SlamNodeConfig)
class SlamParameters(_Checked):
    """Parameters of `/slam_toolbox`."""

    among = SlamNodeConfig


@keys_of(EkfSource)
class EkfSourceParameters(ParameterGroup):
    """A source of `/ekf_filter_node`; of its keys those count that robot_localization has for its kind."""


def _source_name(name: str) -> str:
    if not re.fullmatch(SOURCE, name):
        raise ValueError("a source is called odom0, pose0, twist0, imu0, odom1...")
    return name


SourceName = Annotated[str, AfterValidator(_source_name)]


@keys_of(EkfNodeConfig)
class EkfParameters(_Checked):
    """Parameters of `/ekf_filter_node`."""

    among = EkfConfig
    sources: Mapping[SourceName, EkfSourceParameters] = {}
    """What it listens to besides, or instead of, `odom0` (wheels) and `imu0`."""
