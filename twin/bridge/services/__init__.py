"""Services and their clients."""

from __future__ import annotations

from twin.bridge.services.client import Client
from twin.bridge.services.future import Future
from twin.bridge.services.service import Respond, Service

__all__ = ["Client", "Future", "Respond", "Service"]
