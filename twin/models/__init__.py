"""The robots as URDF/xacro files, and how any such file becomes a `RobotDescription`."""

from twin.models.catalogue import catalogue
from twin.models.kinematics import link_poses
from twin.models.loader import load

__all__ = ["catalogue", "link_poses", "load"]
