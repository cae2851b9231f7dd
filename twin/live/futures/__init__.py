"""What will become of a run: its futures, each in a process that is a fork of it."""

from twin.live.futures.futures import Futures
from twin.live.futures.outcome import Outcome
from twin.live.futures.what_if import WhatIf

__all__ = ["Futures", "Outcome", "WhatIf"]
