"""The robots as URDF/xacro files, and how any such file becomes a `RobotDescription`."""

from typing import TYPE_CHECKING, Any

from twin.models.catalogue import catalogue
from twin.models.options import ReadOptions

if TYPE_CHECKING:
    from twin.models.kinematics import link_poses
    from twin.models.loader import load

__all__ = ["ReadOptions", "catalogue", "link_poses", "load"]


def __getattr__(name: str) -> Any:
    # The command line needs the options to print its help; XML and numpy can wait for a file.
    if name == "load":
        from twin.models.loader import load

        return load
    if name == "link_poses":
        from twin.models.kinematics import link_poses

        return link_poses
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
