"""With what a run was made: versions of the packages that decide its bytes, and the class of CPU."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any, Self

from twin.scenario.outside import ClockMode
from twin.scenario.source import Source

_PACKAGES = ("twin", "mujoco", "numpy", "scipy", "numba", "eclipse-zenoh", "rosbags", "rerun-sdk")
_VECTOR_UNITS = ("avx512f", "avx2", "avx", "asimd", "neon")
"""Best first: the instruction set chooses code paths whose sums round differently."""


@dataclass(frozen=True, kw_only=True)
class Provenance:
    """With what a run was made: enough to make it again where nothing of that has changed."""

    file: str
    """Absolute path of the scenario."""
    scenario: Mapping[str, Any]
    """What it says, with the overrides in it; empty if the scenario was not read from a file."""
    nodes: tuple[str, ...] = ()
    """`FILE.py:FACTORY` of the user's own nodes."""
    clock: ClockMode = "inproc"
    """Whether others took part."""
    files: Mapping[str, str]
    """SHA-256 of the files that the scenario names, as it names them."""
    plugins: Mapping[str, str]
    """What was executed of the user's: a package and its version, or the hash of a file."""
    versions: Mapping[str, str]
    """Of Python and of the packages that can change a result."""
    cpu: str
    """Class of CPU."""

    @property
    def source(self) -> Source:
        """The scenario, to be read again."""
        return Source(Path(self.file), self.scenario)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return what `to_dict` wrote; raises TypeError for anything else."""
        return cls(**{**values, "nodes": tuple(values["nodes"])})


def versions() -> dict[str, str]:
    """Return the version of Python and of each package that can change a result."""
    return {**_versions()}


@cache
def _versions() -> Mapping[str, str]:
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
