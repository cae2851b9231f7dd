"""The same verdicts and the same tree as Debian's check_urdf, wherever twin is not stricter on purpose."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from twin.errors import ModelError
from twin.models import load
from twin.models.graph import graphviz, tree_text

SEEDS = Path(__file__).parents[4] / "shared" / "seed_models"
FILES = ["r2d2.urdf", "simple_robot.urdf.xacro", "sp1s_1.urdf", "sp1s_2.urdf"]
FILES += [f"test_robot_{number}.urdf" for number in (1, 2, 3)]

CHECK_URDF = shutil.which("check_urdf", path="/usr/bin:/usr/local/bin")
"""Debian's; the one that `pip install pin` brings is of a newer urdfdom with other versions of URDF."""
pytestmark = pytest.mark.skipif(
    CHECK_URDF is None,
    reason="check_urdf is not installed (apt-get install liburdfdom-tools)",
)


def joint(inside: str = "", kind: str = "fixed", name: str = "j", parent: str = "a", child: str = "b") -> str:
    ends = f"<parent link='{parent}'/><child link='{child}'/>"
    return f"<joint name='{name}' type='{kind}'>{ends}{inside}</joint>"


def robot(*parts: str, links: str = "ab", head: str = "name='r'") -> str:
    body = "".join(f"<link name='{name}'/>" for name in links)
    return f"<robot {head}>{body}{''.join(parts)}</robot>"


def link_c(inside: str) -> str:
    return robot(joint(), f"<link name='c'>{inside}</link>", joint(name="k", child="c"))


LIMIT = "<limit lower='-1' upper='1' effort='1' velocity='1'/>"
SPHERE = "<geometry><sphere radius='1'/></geometry>"
INERTIA = "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>"

BOTH_ACCEPT = {
    "one link": robot(links="a"),
    "two links": robot(joint()),
    "children by name of the joint": robot(
        joint(name="z", child="b"),
        joint(name="y", child="c"),
        joint(name="x", parent="c", child="d"),
        links="abcd",
    ),
    "angles": robot(
        joint("<origin xyz='1e-7 12345678 -.5' rpy='0.3 -0.7 2.2'/>"),
        joint("<origin rpy='0 1.5707963267949 0.4'/>", name="k", child="c"),
        joint("<origin rpy='0 -1.5707963267949 0.4'/>", name="l", child="d"),
        joint("<origin rpy='3.1415926535898 0 -1'/>", name="m", child="e"),
        links="abcde",
    ),
    "every type": robot(
        joint(LIMIT, "revolute", "j1", "a", "b"),
        joint(LIMIT, "prismatic", "j2", "b", "c"),
        joint("", "continuous", "j3", "c", "d"),
        joint("", "floating", "j4", "d", "e"),
        joint("", "planar", "j5", "e", "f"),
        links="abcdef",
    ),
    "mimic": robot(
        joint(LIMIT, "revolute"), joint(LIMIT + "<mimic joint='j'/>", "revolute", "k", "b", "c"), links="abc"
    ),
    "material under robot": robot(
        f"<link name='a'><visual>{SPHERE}<material name='m'/></visual></link>",
        "<material name='m'><color rgba='1 0 0 1'/></material>",
        links="",
    ),
    "version": robot(links="a", head="name='r' version='1.0'"),
    "inertial": link_c(f"<inertial><mass value='1'/>{INERTIA}</inertial>"),
    "unknown tag": link_c("<colour/>"),
    "long axis": robot(joint("<axis xyz='0 0 5'/>", "continuous")),
}

BOTH_REFUSE = {
    "bad XML": "<robot name='r'><link name='a'></robot>",
    "empty": "<robot name='r'/>",
    "no name": robot(links="a", head=""),
    "version 2": robot(links="a", head="name='r' version='2.0'"),
    "link twice": robot(joint(), links="aab"),
    "joint twice": robot(joint(), joint(child="c"), links="abc"),
    "two roots": robot(links="ab"),
    "cycle": robot(joint(), joint(name="k", parent="b", child="a")),
    "unknown parent": robot(joint(parent="z")),
    "unknown child": robot(joint(child="z")),
    "no parent": robot("<joint name='j' type='fixed'><child link='b'/></joint>"),
    "unknown type": robot(joint(kind="hinge")),
    "revolute without limit": robot(joint(kind="revolute")),
    "bad xyz": robot(joint("<origin xyz='1 2 up'/>")),
    "two numbers": robot(joint("<origin xyz='1 2'/>")),
    "NaN": robot(joint("<origin xyz='nan 0 0'/>")),
    "bad axis": robot(joint("<axis xyz='up'/>", "continuous")),
}

ONLY_TWIN_REFUSES = {
    "two parents": (
        robot(joint(), joint(name="k", parent="c"), joint(name="l", child="c"), links="abc"),
        "two-parents",
    ),
    "negative mass": (link_c(f"<inertial><mass value='-1'/>{INERTIA}</inertial>"), "bad-mass"),
    "impossible inertia": (
        link_c(f"<inertial><mass value='1'/>{INERTIA.replace('1', '9', 1)}</inertial>"),
        "impossible-inertia",
    ),
    "zero axis": (robot(joint("<axis xyz='0 0 0'/>", "continuous")), "zero-axis"),
    "no inertia": (link_c("<inertial><mass value='1'/></inertial>"), "bad-inertial"),
    "unknown geometry": (link_c("<visual><geometry><cone/></geometry></visual>"), "bad-geometry"),
    "bad box": (link_c("<visual><geometry><box size='1 1'/></geometry></visual>"), "bad-number"),
    "lower above upper": (robot(joint(LIMIT.replace("-1", "2"), "revolute")), "swapped-limits"),
}  # fmt: skip
"""Files that check_urdf lets pass with a message at most, and twin's code."""

ONLY_CHECK_URDF_REFUSES = {
    "limit without effort": robot(joint(LIMIT.replace("effort='1'", ""), "revolute")),
    "limit without velocity": robot(joint(LIMIT.replace("velocity='1'", ""), "revolute")),
    "version 1.2": robot(links="a", head="name='r' version='1.2'"),
}
"""A missing effort or velocity is a warning of twin, as a simulation needs neither; newer urdfdom has 1.2."""


def check_urdf(file: Path) -> tuple[bool, str]:
    done = subprocess.run([str(CHECK_URDF), str(file)], capture_output=True, text=True, check=False)
    assert done.returncode in (0, 255)
    return done.returncode == 0, done.stdout


def urdf_to_graphviz(file: Path, folder: Path) -> str:
    subprocess.run(["urdf_to_graphviz", str(file), str(folder / "graph")], capture_output=True, check=True)
    return (folder / "graph.gv").read_text("utf-8")


def codes(file: Path) -> list[str]:
    try:
        load(file)
    except ModelError as fault:
        return [problem.code for problem in fault.problems]
    return []


def saved(text: str, folder: Path) -> Path:
    file = folder / "r.urdf"
    file.write_text(text, encoding="utf-8")
    return file


def assert_same_output(file: Path, folder: Path) -> None:
    description = load(file)
    accepted, printed = check_urdf(file)
    assert accepted
    assert tree_text(description) == printed
    assert graphviz(description) == urdf_to_graphviz(file, folder)


@pytest.mark.parametrize("name", FILES)
def test_the_tutorials_files(name: str, tmp_path: Path) -> None:
    if not SEEDS.is_dir():
        pytest.skip("the tutorials' files are not beside this checkout")
    assert_same_output(SEEDS / name, tmp_path)


@pytest.mark.parametrize("name", BOTH_ACCEPT)
def test_both_accept_and_print_the_same(name: str, tmp_path: Path) -> None:
    assert_same_output(saved(BOTH_ACCEPT[name], tmp_path), tmp_path)


@pytest.mark.parametrize("name", BOTH_REFUSE)
def test_both_refuse(name: str, tmp_path: Path) -> None:
    file = saved(BOTH_REFUSE[name], tmp_path)
    assert not check_urdf(file)[0]
    assert codes(file)


@pytest.mark.parametrize("name", ONLY_TWIN_REFUSES)
def test_only_twin_refuses(name: str, tmp_path: Path) -> None:
    text, code = ONLY_TWIN_REFUSES[name]
    file = saved(text, tmp_path)
    assert check_urdf(file)[0]
    assert code in codes(file)


@pytest.mark.parametrize("name", ONLY_CHECK_URDF_REFUSES)
def test_only_check_urdf_refuses(name: str, tmp_path: Path) -> None:
    file = saved(ONLY_CHECK_URDF_REFUSES[name], tmp_path)
    assert not check_urdf(file)[0]
    assert codes(file) == []
