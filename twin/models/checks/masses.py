"""Parts that weigh nothing, and parts that cannot be touched."""

from __future__ import annotations

from collections.abc import Iterator

from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.description import WORLD, RobotDescription
from twin.models.kinematics import rigid_groups


def masses(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield rigid parts (links on fixed joints) without mass, and visible ones without collision shape."""
    heads = rigid_groups(description)
    heavy = description.settlement.bodies
    for head in dict.fromkeys(heads.values()):
        links = [description.links[name] for name in heads if heads[name] == head]
        fixed = ", ".join(link.name for link in links if link.name != head)
        others = f" (nor do the links fixed to it: {fixed})" if fixed else ""
        line = description.links[head].line
        if not any(link.name in heavy for link in links) and head != WORLD:
            code, message = "massless", f"moves and weighs nothing{others}"
            if head == description.root:
                code = "massless-base"
                message = f"the base '{head}' weighs nothing{others}; it can only be fixed to the ground"
            fix = "give it <inertial> with <mass value='…'/> and <inertia ixx='…' iyy='…' izz='…'/>"
            yield finding(description, code, f"link '{head}'", line, message, fix)
        visible = [link.name for link in links if link.visuals]
        also = f" (also of {', '.join(visible[1:])})" if visible[1:] else ""
        if visible and not any(link.collisions for link in links):
            first, line = f"link '{visible[0]}'", description.links[visible[0]].line
            message = f"seen, not touched: there is no collision shape{also}"
            fix = "add <collision> with the same <origin> and a simple <geometry>"
            yield finding(description, "no-collision", first, line, message, fix)
