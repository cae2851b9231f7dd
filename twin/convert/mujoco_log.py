"""MuJoCo's warnings go to Python's logging, not to stderr and a MUJOCO_LOG.TXT in the current folder."""

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco

mujoco.set_mju_user_warning(logging.getLogger("twin.mujoco").info)


@contextmanager
def without_warnings() -> Iterator[None]:
    """Compile a model without a warning of a singular mass matrix, which twin looks for itself."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Inertia matrix is too close to singular")
        yield
