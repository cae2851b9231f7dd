"""OpenCV, which is no part of the core."""

from __future__ import annotations

from types import ModuleType

from twin.errors import ScenarioError


def opencv() -> ModuleType:
    """Return `cv2`, with one thread: so it takes no time from others, and sums are in one order.

    Raises:
        ScenarioError: It is not installed.
    """
    try:
        import cv2
    except ImportError:
        raise ScenarioError("tags need OpenCV, which is not installed: pip install 'twin[vision]'") from None
    cv2.setNumThreads(1)
    return cv2
