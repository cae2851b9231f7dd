"""The smallest scenario that still fails the same checks."""

from twin.experiments.shrink.shrink import Shrunk, shrink

__all__ = ["Shrunk", "shrink"]
