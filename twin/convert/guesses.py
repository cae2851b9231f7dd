"""What a conversion chose for links because the robot file does not say it."""

from __future__ import annotations

from collections.abc import Iterator

from twin.convert.contact_roles import Roles
from twin.convert.conversion import Guess
from twin.models.description import RobotDescription


def contact_guesses(description: RobotDescription, roles: Roles) -> Iterator[Guess]:
    """Yield what was chosen for the contacts of links, in file order."""
    for link in description.links.values():
        element = f"link '{link.name}'"
        if link.name in roles.wheels:
            yield Guess(element=f"contact of {element}", note="carries the robot without sinking in")
        if link.surface.friction is None and link.name in roles.casters:
            yield Guess(element=f"friction of {element}", note="none: it slides where a caster would roll")
        elif link.surface.friction is None and link.collisions:
            note = "the larger of 1 and that of what it touches"
            yield Guess(element=f"friction of {element}", note=note)
        if link.name in roles.gripping:
            note = "stiff: a commanded joint presses it against things"
            yield Guess(element=f"contact of {element}", note=note)
