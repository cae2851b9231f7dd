"""Names that nobody should give, and names that the conversion makes itself."""

from __future__ import annotations

from tests.oracles.odd.case import BALL, INERTIAL, Model, accepted, joint, link, pair, refused, robot

ODD = {
    "with spaces": "left wheel joint",
    "with a slash": "../a/b",
    "in other scripts": "gelenk_ä_関節",
    "an emoji": "🤖",
    "quoted": "a&quot;b&lt;&amp;&apos;",
    "very long": "x" * 5000,
    "of a shell": "$HOME;`ls` %s%n \\n",
    "of a mesh": "x#0",
    "with a tilde": "a~b",
    "of rich": "[bold]x[/bold][/]",
}
ENTITIES = {"&quot;": '"', "&lt;": "<", "&amp;": "&", "&apos;": "'"}


def _plain(name: str) -> str:
    for entity, char in ENTITIES.items():
        name = name.replace(entity, char)
    return name


def _has(link_name: str, joint_name: str) -> object:
    def holds(model: Model) -> bool:
        return model.body(_plain(link_name)).mass[0] == 1 and model.joint(_plain(joint_name)).type[0] == 3

    return holds


SOLID = f"{INERTIAL}<collision>{BALL}</collision>"
NAMES = {
    **{
        f"names {what}": accepted(
            robot(link(f"l{name}"), link("b"), joint(f"j{name}", parent=f"l{name}"), head=f"name='{name}'"),
            _has(f"l{name}", f"j{name}"),  # type: ignore[arg-type]
        )
        for what, name in ODD.items()
    },
    "a joint named as its link": accepted(pair(name="a"), _has("a", "a")),  # type: ignore[arg-type]
    "a joint named world": accepted(pair(name="world"), _has("a", "world")),  # type: ignore[arg-type]
    "line break in a joint's name": refused(pair(name="a&#10;b"), "has spaces at its ends or line breaks"),
    "tab in a link's name": refused(robot(link("a&#9;b")), "has spaces at its ends or line breaks"),
    "line break in the robot's name": accepted(
        robot(link(), head="name='a&#10;b'"), lambda m: m.names.startswith(b"a b\0")
    ),
    "control character": refused(pair(name="a&#1;b"), "invalid character number"),
    "space at the end": refused(robot(link("a "), link("b"), joint()), "has spaces at its ends"),
    "a space": refused(robot(link(" ")), "<link> has no name="),
    "link twice": refused(robot(link(), link()), "link 'a' is defined twice"),
    "joint twice": refused(robot(*map(link, "abc"), joint(), joint(child="c")), "joint 'j' is defined twice"),
    "a child named world": accepted(
        robot(link("a"), link("world"), joint(child="world")),
        lambda m: m.body("world_link").mass[0] == 1 and m.nv == 7,
    ),
    "a root named world and a world_link": accepted(
        robot(link("world", ""), link("world_link"), joint(parent="world", child="world_link")),
        lambda m: m.body("world_link").mass[0] == 1 and m.body("world_link_2").mass[0] == 0 and m.nv == 1,
    ),
    "a joint named as the base's": accepted(
        pair(name="a_free_joint"),
        lambda m: m.joint("a_free_joint").type[0] == 3 and m.joint("a_free_joint_2").type[0] == 0,
    ),
    "named as part of a planar joint": refused(
        robot(*map(link, "abc"), joint(kind="planar"), joint("j_x", child="c")), "rename it"
    ),
    "named as part of a floating joint": refused(
        robot(*map(link, "abc"), joint(kind="floating"), joint("j_rotation", child="c")), "rename it"
    ),
    "named as an equality": accepted(
        robot(*map(link, "abc"), joint(), joint("j_mimic", child="c", inside="<mimic joint='j'/>")),
        lambda m: m.equality("j_mimic_mimic").type[0] == 2,
    ),
    "excluded pairs of one name": accepted(
        robot(
            *(link(name, SOLID) for name in ("a", "b~c", "a~b", "c")),
            joint("1", child="b~c"),
            joint("2", child="a~b"),
            joint("3", parent="a~b", child="c"),
        ),
        lambda m: m.nexclude == 6,
    ),
}
"""What is odd about the names, and the outcome."""
