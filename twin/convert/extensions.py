"""What `<gazebo>` adds to links and joints beyond contacts: no gravity, springs."""

from __future__ import annotations

import mujoco

from twin.models.description import RobotDescription


def add_extensions(spec: mujoco.MjSpec, description: RobotDescription) -> None:
    """Hold up the links that gravity does not pull, and add springs to joints."""
    for link in description.links.values():
        if not link.surface.gravity:
            spec.body(link.name).gravcomp = 1.0
    for name, spring in description.springs.items():
        joint = spec.joint(name)
        joint.stiffness[0] = spring.stiffness
        joint.springref = spring.reference
