"""Lock-step: nodes of other processes take part in a deterministic run."""

from __future__ import annotations

from twin.bridge.lockstep.participant import join

__all__ = ["join"]
