"""Files of ROS packages that a robot description names: meshes and their pictures, nothing else."""

from __future__ import annotations

from pathlib import Path

from twin.models.options import ReadOptions
from twin.models.urdf.packages import PackagePath, Packages, locate

_SUFFIXES = {".dae", ".stl", ".obj", ".mtl", ".glb", ".gltf", ".bin", ".png", ".jpg", ".jpeg", ".urdf"}
_LARGEST_BYTES = 256 << 20


class Assets:
    """Finds `package://` files by the packages around a folder and of the environment."""

    def __init__(self, folder: Path) -> None:
        self._source = folder / "robot.urdf"
        self._packages = Packages(PackagePath.of(self._source, ReadOptions()))

    def read(self, uri: str) -> bytes | None:
        """Return a file's content; None: there is none, or it may not be given."""
        if not uri.startswith("package://") or Path(uri).suffix.lower() not in _SUFFIXES:
            return None
        path = locate(uri, self._source, self._packages).path
        if path is None or path.stat().st_size > _LARGEST_BYTES:
            return None
        return path.read_bytes()
