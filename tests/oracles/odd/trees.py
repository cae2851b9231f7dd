"""Links and joints that are no tree, or a very large one."""

from __future__ import annotations

from tests.oracles.odd.case import INERTIAL, accepted, chain, joint, link, pair, refused, robot


def _star(count: int, follows: bool = False) -> str:
    joints = [
        joint(
            f"j{i}",
            parent="l0",
            child=f"l{i}",
            inside=f"<mimic joint='j{i - 1}'/>" if follows and i > 1 else "",
        )
        for i in range(1, count)
    ]
    return robot(*(link(f"l{i}") for i in range(count)), *joints)


def _mimics(*leaders: str) -> str:
    links = [link("a"), *(link(f"l{i}") for i in range(len(leaders)))]
    joints = [
        joint(f"j{i}", parent="a", child=f"l{i}", inside=f"<mimic joint='{leader}'/>" if leader else "")
        for i, leader in enumerate(leaders)
    ]
    return robot(*links, *joints)


TREES = {
    "no links": refused(robot(), "the robot has no links"),
    "two roots": refused(robot(link("a"), link("b")), "2 root links (a, b)"),
    "1500 roots": refused(
        robot(*(link(f"l{i}") for i in range(1500))), "1500 root links (l0, ", "and 1480 more"
    ),
    "its own parent": refused(robot(link("a"), link("b"), joint(parent="b")), "form a cycle: b -> b"),
    "only its own parent": refused(robot(link("a"), joint(parent="a", child="a")), "a -> a"),
    "a ring": refused(
        robot(*map(link, "abc"), *(joint(f"j{a}", parent=a, child=b) for a, b in ("ab", "bc", "ca"))),
        "form a cycle",
    ),
    "two parents": refused(
        robot(*map(link, "abc"), joint("j"), joint("k", parent="c")), "link 'b' has two parents"
    ),
    "unknown child": refused(robot(link("base"), joint(parent="base", child="bsae")), "did you mean 'base'?"),
    "1900 unknown children": refused(
        robot(
            *(link(f"l{i}") for i in range(1900)),
            *(joint(f"j{i}", parent="l0", child=f"x{i}") for i in range(1900)),
        ),
        "child link 'x7' of joint 'j7' does not exist",
    ),
    "unknown type": refused(pair(kind="Revolute"), "did you mean 'revolute'?"),
    "floating twice": accepted(
        robot(*map(link, "abc"), joint("j", "floating"), joint("k", "floating", parent="b", child="c")),
        lambda m: m.nv == 18,
    ),
    "follows a planar joint": accepted(
        robot(*map(link, "abc"), joint("j", "planar"), joint("k", child="c", inside="<mimic joint='j'/>")),
        lambda m: m.nv == 10 and m.neq == 1,
    ),
    "a planar follower": accepted(
        robot(*map(link, "abc"), joint("j"), joint("k", "planar", child="c", inside="<mimic joint='j'/>")),
        lambda m: m.nv == 10 and m.neq == 0,
        "idle-mimic",
    ),
    "follows nobody": accepted(pair(inside="<mimic joint='x'/>"), lambda m: m.neq == 0, "idle-mimic"),
    "follows itself": refused(pair(inside="<mimic joint='j'/>"), "mimics itself: j -> j"),
    "followers in a ring": refused(_mimics("j1", "j2", "j0", "j0"), "mimics itself: j0 -> j1 -> j2 -> j0"),
    "a chain of followers, last first": accepted(_mimics("j1", "j2", ""), lambda m: m.neq == 2),
    "1200 followers in a row": accepted(_star(1201, follows=True), lambda m: m.neq == 1199),
    "400 links in a row": accepted(chain("continuous", 400), lambda m: m.nbody == 401 and m.nv == 405),
    "1000 links in a row": refused(chain("continuous", 1000), "more than 450 links hang on each other"),
    "1000 fixed links in a row": refused(chain("fixed", 1000), "more than 450 links hang on each other"),
    "1500 links in a star": accepted(_star(1501), lambda m: m.nv == 1506),
    "3000 links in a star": refused(_star(3001), "the robot has 3001 <link>; at most 2000 are read"),
    "100000 links": refused(
        robot(link("a", INERTIAL), "<link name='b'/>" * 100_000), "at most 2000 are read"
    ),
}
"""What is odd about the tree, and the outcome."""
