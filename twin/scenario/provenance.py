"""With what a run was made: versions of the packages that decide its bytes, and the class of CPU."""

from __future__ import annotations

import platform
from importlib import metadata
from pathlib import Path

_PACKAGES = ("twin", "mujoco", "numpy", "scipy", "numba", "eclipse-zenoh", "rosbags", "rerun-sdk")
_VECTOR_UNITS = ("avx512f", "avx2", "avx", "asimd", "neon")
"""Best first: the instruction set chooses code paths whose sums round differently."""


def versions() -> dict[str, str]:
    """Return the version of Python and of each package that can change a result."""
    found = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "not installed"
    return found


def cpu_class() -> str:
    """Return architecture, model and best vector unit; digests are comparable within one class."""
    model, flags = platform.processor(), set[str]()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text(encoding="utf-8", errors="replace").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name":
                model = value.strip()
            elif key.strip() in ("flags", "Features"):
                flags = set(value.split())
                break
    vector = next((unit for unit in _VECTOR_UNITS if unit in flags), "no vector unit known")
    return ", ".join(part for part in (platform.machine(), model, vector) if part)
