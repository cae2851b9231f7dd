"""Files that are no robot, or hardly one."""

from __future__ import annotations

import os
from pathlib import Path

from tests.oracles.odd.case import BALL, INERTIAL, LIMIT, accepted, link, pair, refused, robot


def _device(path: Path) -> None:
    path.symlink_to("/dev/zero")


WHOLE = robot(link())
XML = {
    "empty": refused("", "the file is empty"),
    "only spaces": refused(" \n ", "the file is empty"),
    "a folder": refused(Path.mkdir, "it is a folder"),
    "a pipe": refused(os.mkfifo, "it is a pipe"),
    "an endless device": refused(_device, "it is a device"),
    "binary": refused(bytes(range(256)), "is no UTF-8"),
    "a null byte": refused(WHOLE.replace("><", ">\0<", 1), "null byte"),
    "HTML": refused("<html><body><p>404</p></body></html>", "root element is <html>"),
    "HTML5": refused("<!DOCTYPE html><html/>", "DOCTYPE"),
    "SDF": refused("<sdf version='1.6'><model name='m'/></sdf>", "root element is <sdf>"),
    "MJCF": refused("<mujoco><worldbody/></mujoco>", "root element is <mujoco>"),
    "xacro without its namespace": refused(robot("<xacro:property name='a' value='1'/>"), "prefix xacro"),
    "a robot in a robot": accepted(robot(link(), robot(link("b"))), lambda m: m.nbody == 2, "ignored-tag"),
    "two robots": refused(WHOLE + WHOLE, "junk after document element"),
    "text behind": refused(WHOLE + "junk", "junk after document element"),
    "text between": accepted(robot("hello", link(), "world"), lambda m: m.nbody == 2),
    "byte order mark": accepted("\ufeff" + WHOLE, lambda m: m.nbody == 2),
    "comment in a comment": refused(robot("<!-- a <!-- b --> -->", link()), "not well-formed"),
    "comment in a value": refused(pair(inside="<origin xyz='1 <!-- --> 2 3'/>"), "not well-formed"),
    "CDATA": accepted(robot(link(), "<![CDATA[<link name='b'/>]]>"), lambda m: m.nbody == 2),
    "processing instruction": accepted("<?php echo 1 ?>" + robot("<?x?>", link()), lambda m: m.nbody == 2),
    "namespaces": accepted(
        f"<robot xmlns='http://x' xmlns:q='http://q' name='r'>{link()}<q:link name='z'/></robot>",
        lambda m: m.nbody == 2,
        "ignored-tag",
    ),
    "attribute twice": refused("<robot name='r' name='s'/>", "duplicate attribute"),
    "other attributes": accepted(
        robot(f"<link name='a' mass='3'>{INERTIAL}</link>"),
        lambda m: m.body("a").mass == 1,
        "ignored-attribute",
    ),
    "tags in capitals": refused("<robot name='r'><Link name='a'/></robot>", "the robot has no links"),
    "shape in capitals": refused(
        robot(link("a", "<visual><geometry><Box size='1 1 1'/></geometry></visual>")), "did you mean 'box'?"
    ),
    "no name": refused("<robot><link/><joint/></robot>", "<link> has no name=", "<joint> has no <parent"),
    "empty name": refused(robot(link(), head="name=''"), "<robot> has no name="),
    "link in a link": accepted(robot(link("a", INERTIAL + link("z"))), lambda m: m.nbody == 2, "ignored-tag"),
    "two inertials": refused(robot(link("a", INERTIAL * 2)), "link 'a' has 2 <inertial>"),
    "two limits": accepted(
        pair(kind="revolute", inside=LIMIT + LIMIT.replace("'1'", "'3'")),
        lambda m: m.joint("j").range[1] == 1,
        "repeated-tag",
    ),
    "two geometries": accepted(
        robot(link("a", f"{INERTIAL}<collision>{BALL}{BALL}</collision>")),
        lambda m: m.ngeom == 1,
        "repeated-tag",
    ),
    "two shapes": refused(
        robot(link("a", "<visual><geometry><sphere radius='1'/><box size='1 1 1'/></geometry></visual>")),
        "one <geometry> with one shape",
    ),
    "two parents in a joint": accepted(
        pair(inside="<parent link='b'/>"), lambda m: m.body("b").parentid == m.body("a").id, "repeated-tag"
    ),
    "too many levels": refused(
        robot("<a>" * 101 + "</a>" * 101), "more than 100 elements inside of each other"
    ),
    "entity bomb": refused(
        "<!DOCTYPE r [<!ENTITY a '" + "a" * 1000 + "'><!ENTITY b '" + "&a;" * 1000 + "'>]>" + robot("&b;"),
        "DOCTYPE",
    ),
    "reads a file": refused(
        "<!DOCTYPE r [<!ENTITY a SYSTEM 'file:///etc/passwd'>]>" + robot("&a;"), "DOCTYPE"
    ),
    "joint of nothing": refused(robot(link(), "<joint name='j'/>"), "has type ''", "has no <child"),
    "texture elsewhere": accepted(
        robot(
            link(
                "a",
                f"{INERTIAL}<visual>{BALL}<material name='m'>"
                f"<texture filename='/etc/passwd'/></material></visual>",
            )
        ),
        lambda m: m.ntex == 0,
    ),
    "attack on xacro": refused(
        robot("<link name='${[].__class__}'/>", head="name='r' xmlns:xacro='http://www.ros.org/wiki/xacro'"),
        "xacro: ",
        name="r.urdf.xacro",
    ),
    "endless macro": refused(
        robot(
            "<xacro:macro name='m'><xacro:m/></xacro:macro><xacro:m/>",
            head="name='r' xmlns:xacro='http://www.ros.org/wiki/xacro'",
        ),
        "xacro: ",
        name="r.urdf.xacro",
    ),
}
"""What the file is, and its outcome."""
