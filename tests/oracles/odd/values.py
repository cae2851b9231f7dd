"""Numbers that are none, or that no simulation can take."""

from __future__ import annotations

import math

import numpy as np

from tests.oracles.odd.case import INERTIAL, Case, accepted, joint, link, pair, refused, robot, shaped


def _mass(value: str) -> str:
    return robot(link("a", INERTIAL.replace("value='1'", f"value='{value}'")))


def _weighs(value: str, mass: float) -> Case:
    return accepted(_mass(value), lambda m: m.body("a").mass[0] == mass)


def _limit(values: str, kind: str = "revolute") -> str:
    return pair(kind=kind, inside=f"<limit {values}/>")


def _axis(values: str) -> str:
    return pair(inside=f"<axis xyz='{values}'/>")


NO_NUMBERS = ("0x10", "1,5", "1 kg", "1_000", "１", "٣", "1d0", "1e", "--1", "one", "1/2", "1\u00a0", "")
NUMBERS = {"+1": 1.0, ".5": 0.5, "5.": 5.0, "1E1": 10.0, " 2 ": 2.0, "1e9": 1e9}
VALUES = {
    **{f"mass '{value}'": refused(_mass(value), "<mass> of link 'a': value=") for value in NO_NUMBERS},
    **{f"mass '{value}'": _weighs(value, mass) for value, mass in NUMBERS.items()},
    **{f"mass {value}": refused(_mass(value), "is not finite") for value in ("inf", "-Infinity", "NaN")},
    "mass 1e300": refused(_mass("1e300"), "is out of range"),
    "mass -1": refused(_mass("-1"), "a mass is more than"),
    "mass 1e-300": refused(_mass("1e-300"), "has mass 1e-300 kg"),
    "mass 0 on a fixed base": accepted(
        _mass("0").replace(".01", "0"), lambda m: m.nv == 0, options=("--base", "fixed")
    ),
    "no inertia": accepted(
        pair().replace("'.01'", "'0'"), lambda m: min(m.body_inertia[1:].ravel()) > 0, "repaired-inertia"
    ),
    "negative inertia": refused(pair().replace("ixx='.01'", "ixx='-.01'"), "are not all positive"),
    "huge products of inertia": refused(
        pair().replace("<inertia ", "<inertia ixy='100' "), "impossible inertia"
    ),
    "inertia of no body": refused(pair().replace("ixx='.01'", "ixx='1'"), "exceeds the sum of the others"),
    "inertia of no body, repaired": accepted(
        pair().replace("ixx='.01'", "ixx='1'"),
        lambda m: m.nbody == 3,
        "repaired-inertia",
        options=("--repair",),
    ),
    "lower is upper": accepted(
        _limit("lower='1' upper='1'"), lambda m: m.joint("j").limited == 0, "no-range"
    ),
    "lower above upper": refused(_limit("lower='1' upper='-1'"), "is above the upper limit"),
    "limits for none": accepted(
        _limit("lower='-1e30' upper='1e30'"), lambda m: m.joint("j").range[1] == 1e30
    ),
    "endless limits with a motor": accepted(
        _limit("lower='-1e300' upper='1e300' effort='1' velocity='1'"),
        lambda m: m.joint("j").range[1] == 1e300,
    ),
    "infinite limits": refused(_limit("lower='-inf' upper='inf'"), "lower='-inf' is not finite"),
    "hardly a range": accepted(_limit("lower='0' upper='1e-300'"), lambda m: m.joint("j").limited == 0),
    "hardly an effort": accepted(
        _limit("effort='1e-300'", "continuous"), lambda m: not m.jnt_actfrclimited.any()
    ),
    "huge effort": accepted(
        _limit("effort='1e300'", "continuous"), lambda m: m.jnt_actfrcrange[1, 1] == 1e300
    ),
    "infinite effort": refused(_limit("effort='inf'"), "effort='inf' is not finite"),
    "negative effort": refused(_limit("effort='-1'"), "effort limit -1 is negative"),
    "velocity NaN": refused(_limit("velocity='NaN'"), "velocity='NaN' is not finite"),
    "no limit": refused(pair(kind="prismatic"), "is prismatic and has no <limit"),
    "long axis": accepted(_axis("0 0 1e10"), lambda m: m.joint("j").axis[2] == 1, "axis-length"),
    "short axis": accepted(_axis("0 1e-8 0"), lambda m: m.joint("j").axis[1] == 1, "axis-length"),
    "denormal axis": refused(_axis("1e-310 0 0"), "has a zero axis"),
    "axis of two numbers": refused(_axis("1 0"), "has 2 numbers, not 3"),
    "many turns": accepted(
        pair(inside="<origin rpy='1e6 0 0'/>"),
        lambda m: abs(m.body("b").quat[0]) - abs(math.cos(5e5)) < 1e-9,
    ),
    "far away": refused(pair(inside="<origin xyz='1e9 0 0'/>"), "xyz='1e9 0 0' is out of range"),
    "far, not too far": accepted(pair(inside="<origin xyz='1e5 0 0'/>"), lambda m: m.body("b").pos[0] == 1e5),
    "negative damping": refused(pair(inside="<dynamics damping='-1'/>"), "damping -1 is negative"),
    "huge damping": accepted(
        pair(inside="<dynamics damping='1e10'/>"), lambda m: max(np.ravel(m.dof_damping)) == 1e10
    ),
    "box of zeros": refused(shaped("<box size='0 0 0'/>"), "not positive"),
    "box of four numbers": refused(shaped("<box size='1 1 1 1'/>"), "has 4 numbers, not 3"),
    "box without a size": refused(shaped("<box/>"), "has no size="),
    "negative radius": refused(shaped("<sphere radius='-1'/>"), "not positive"),
    "cylinder without a length": refused(shaped("<cylinder radius='1'/>"), "has no length="),
    "unknown shape": refused(shaped("<plane normal='0 0 1'/>"), "unknown geometry <plane>"),
    "no shape": refused(shaped(""), "one <geometry> with one shape"),
    "color of NaN": refused(
        shaped("<sphere radius='1'/>", "visual").replace(
            "</visual>", "<material><color rgba='1 nan 0 1'/></material></visual>"
        ),
        "is not finite",
    ),
    "follower that stands still": accepted(
        robot(
            *map(link, "abc"), joint("j"), joint("k", child="c", inside="<mimic joint='j' multiplier='0'/>")
        ),
        lambda m: m.eq_data[0][1] == 0,
    ),
    "follower beyond all bounds": accepted(
        robot(
            *map(link, "abc"),
            joint("j"),
            joint("k", child="c", inside="<mimic joint='j' multiplier='-1e10'/>"),
        ),
        lambda m: m.eq_data[0][1] == -1e10,
    ),
}
"""What is odd about the numbers, and the outcome."""
