"""What `/amcl` says of itself on `/diagnostics`."""

from __future__ import annotations

import math

from twin.bridge.msgs import DiagnosticStatus, KeyValue
from twin.navigation.localisation.amcl import Amcl


def amcl_status(name: str, amcl: Amcl, fault: str) -> DiagnosticStatus:
    """Return the state of a filter: ERROR while the robot is lost or its inputs are of no use.

    Args:
        name: Of the status.
        amcl: The filter.
        fault: Why its inputs are of no use, or empty.
    """
    estimate = amcl.estimate
    if estimate is None:
        level, message = DiagnosticStatus.WARN, "no scan yet"
    elif fault:
        level, message = DiagnosticStatus.ERROR, fault
    elif estimate.lost:
        level, message = DiagnosticStatus.ERROR, "lost: the scan does not fit the map"
    else:
        level, message = DiagnosticStatus.OK, "localised"
    values = {"particles": f"{len(amcl.particles)}"}
    if estimate is not None:
        variance = estimate.covariance.diagonal()
        values["fit"], values["lost"] = f"{estimate.fit:.3f}", f"{estimate.lost:.3f}"
        values["std_xy"] = f"{math.sqrt(variance[0] + variance[1]):.4f}"
        values["std_yaw"] = f"{math.sqrt(variance[2]):.4f}"
    values["surface_depth"], values["sigma_hit"] = f"{amcl.hits.depth:.4f}", f"{amcl.hits.sigma:.4f}"
    return DiagnosticStatus(
        level=level,
        name=name,
        message=message,
        hardware_id="",
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )
