"""twin check, tree, graph, convert: exit codes and output."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

GOOD = (
    "<robot name='r'>\n<link name='a'>\n<inertial><mass value='0.6'/>"
    "<inertia ixx='0.001' iyy='0.001' izz='0.001'/></inertial>\n"
    "<collision><geometry><box size='0.1 0.1 0.1'/></geometry></collision>\n</link>\n"
    "<link name='b'/>\n"
    "<joint name='j' type='fixed'><origin rpy='{}'/><parent link='a'/><child link='{}'/></joint>\n</robot>\n"
)
XACRO = (
    "<robot name='r' xmlns:xacro='http://www.ros.org/wiki/xacro'><xacro:arg name='who' default='a'/>"
    "<xacro:include filename='$(find parts)/part.xacro'/><link name='$(arg who)'/></robot>"
)
HEAVY = ("mujoco", "zenoh", "rerun", "numpy", "scipy", "lxml")

Invoke = Callable[..., tuple[int, str, str]]


@pytest.fixture
def urdf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    monkeypatch.chdir(tmp_path)

    def write(rpy: str = "0 0 0", child: str = "b") -> Path:
        Path("r.urdf").write_text(GOOD.format(rpy, child), encoding="utf-8")
        return Path("r.urdf")

    return write


def test_a_sound_robot(invoke: Invoke, urdf: Callable[..., Path]) -> None:
    assert invoke("check", urdf()) == (0, "r.urdf: no faults found (2 links, 1 joint)\n", "")


def test_warnings_show_place_source_and_fix_and_fail_only_if_strict(
    invoke: Invoke, urdf: Callable[..., Path]
) -> None:
    file = urdf("0 0 1.57")
    code, out, _ = invoke("check", file)
    assert code == 0
    joint = GOOD.format("0 0 1.57", "b").splitlines()[6]
    assert out.splitlines() == [
        "r.urdf:7: warning[rounded-angle]: joint 'j': rpy='0 0 1.57': 1.57 is 0.046 degrees off 90 degrees",
        f"    {joint}",
        "    fix: write 1.570796327",
        "r.urdf: 1 warning (2 links, 1 joint)",
    ]
    assert invoke("check", file, "--strict")[0] == 1


def test_errors_exit_2_all_at_once(invoke: Invoke, urdf: Callable[..., Path]) -> None:
    file = urdf("0 0 up", "c")
    code, out, _ = invoke("check", file, "--strict")
    assert code == 2
    assert "r.urdf:7: error[bad-number]: <origin> of joint 'j': rpy='0 0 up' is not 3 numbers" in out
    assert "r.urdf:7: error[unknown-link]: child link 'c' of joint 'j' does not exist" in out
    assert "fix: define the link, or correct the name (Valid: a, b)" in out
    assert out.endswith("r.urdf: 3 errors\n")


def test_many_warnings_alike_are_grouped_and_errors_never(
    invoke: Invoke, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    links = "".join(
        f"<link name='l{i}'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1'/></inertial></link>\n"
        for i in range(9)
    )
    joints = "".join(
        f"<joint name='j{i}' type='fixed'><origin rpy='0 0 1.57'/>"
        f"<parent link='l0'/><child link='l{i}'/></joint>\n"
        for i in range(1, 9)
    )
    Path("many.urdf").write_text(f"<robot name='r'>\n{links}{joints}</robot>", encoding="utf-8")
    _, out, _ = invoke("check", "many.urdf")
    assert out.splitlines()[-2:] == [
        "many.urdf: warning[rounded-angle]: and 3 more, in full with --all: "
        "joint 'j6' (16), joint 'j7' (17), joint 'j8' (18)",
        "many.urdf: 8 warnings (9 links, 8 joints)",
    ]
    assert out.count("fix:") == 5
    assert invoke("check", "many.urdf", "--all")[1].count("fix:") == 8
    assert len(json.loads(invoke("check", "many.urdf", "--json")[1])["diagnostics"]) == 8
    Path("bad.urdf").write_text("<robot name='r'>" + "<link/>\n" * 9 + "</robot>", encoding="utf-8")
    _, out, _ = invoke("check", "bad.urdf")
    assert out.count("error[missing-attribute]") == 9


def test_json_for_tools(invoke: Invoke, urdf: Callable[..., Path]) -> None:
    code, out, _ = invoke("check", urdf("0 0 1.57"), "--json", "--strict")
    document = json.loads(out)
    assert (code, document["robot"], document["errors"], document["warnings"]) == (1, "r", 0, 1)
    (found,) = document["diagnostics"]
    assert (found["code"], found["element"], found["file"], found["line"]) == (
        "rounded-angle",
        "joint 'j'",
        "r.urdf",
        7,
    )
    code, out, _ = invoke("check", "nowhere.urdf", "--json")
    document = json.loads(out)
    assert (code, document["robot"], document["diagnostics"][0]["code"]) == (2, None, "no-file")


def test_arguments_and_packages(invoke: Invoke, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.urdf.xacro").write_text(XACRO, encoding="utf-8")
    (tmp_path / "pkg").mkdir()
    (tmp_path / "pkg" / "part.xacro").write_text("<robot/>", encoding="utf-8")
    code, out, _ = invoke("tree", "r.urdf.xacro", "--arg", "who:=me", "--package", "parts=pkg")
    assert (code, out.splitlines()[2]) == (0, "root Link: me has 0 child(ren)")
    code, out, _ = invoke("check", "r.urdf.xacro")
    assert code == 2
    assert "error[xacro]" in out
    code, _, err = invoke("check", "r.urdf.xacro", "--arg", "who=me")
    assert (code, err) == (2, "error: --arg who=me: must be NAME:=VALUE, such as --arg wheel_radius:=0.06\n")
    code, _, err = invoke("check", "r.urdf.xacro", "--package", "parts")
    assert code == 2
    assert "must be NAME=PATH" in err


def test_tree_is_check_urdfs(invoke: Invoke, urdf: Callable[..., Path]) -> None:
    code, out, _ = invoke("tree", urdf())
    assert (code, out) == (
        0,
        "robot name is: r\n---------- Successfully Parsed XML ---------------\n"
        "root Link: a has 1 child(ren)\n    child(1):  b\n",
    )
    code, out, err = invoke("tree", urdf(child="c"))
    assert (code, out) == (255, "")
    assert "child link 'c'" in err


def test_graph(invoke: Invoke, urdf: Callable[..., Path], tmp_path: Path) -> None:
    file = urdf()
    code, text, _ = invoke("graph", file)
    assert code == 0
    assert text.startswith("digraph G {\nnode [shape=box];\n")
    assert '"a" -> "j" [label="xyz: 0 0 0 \\nrpy: 0 -0 0"]' in text
    assert invoke("graph", file, "-o", "new/r.gv")[0] == 0
    assert Path("new/r.gv").read_text("utf-8") == text
    assert invoke("graph", file, "-o", "r.svg")[0] == 0
    drawn = ElementTree.parse("r.svg").getroot()
    texts = [element.text for element in drawn.iter("{http://www.w3.org/2000/svg}text")]
    assert texts == ["a", "j (fixed)", "xyz: 0 0 0", "rpy: 0 -0 0", "b"]
    code, _, err = invoke("graph", file, "-o", "r.pdf")
    assert (code, err) == (2, "error: --output r.pdf: must end in .gv or .svg\n")


def test_svg_boxes_do_not_overlap(invoke: Invoke, tmp_path: Path) -> None:
    assert invoke("graph", "warehouse_bot", "-o", tmp_path / "w.svg")[0] == 0
    rects = [
        tuple(float(rect.get(key, "")) for key in ("x", "y", "width", "height"))
        for rect in ElementTree.parse(tmp_path / "w.svg").iter("{http://www.w3.org/2000/svg}rect")
        if rect.get("x")
    ]
    assert len(rects) == 39
    for i, (x, y, width, height) in enumerate(rects):
        for u, v, wide, high in rects[:i]:
            assert x + width <= u or u + wide <= x or y + height <= v or v + high <= y


def test_convert(invoke: Invoke, urdf: Callable[..., Path], tmp_path: Path) -> None:
    code, out, _ = invoke("convert", urdf("0 0 1.57"), "-o", "out", "--base", "fixed")
    assert code == 0
    assert out.startswith("out/robot.xml: 2 links, 1 joint, 0.6 kg; tags: ")
    assert "1 warning: see `twin check r.urdf`" in out
    assert sorted(path.name for path in Path("out").iterdir()) == ["report.json", "robot.xml"]
    report = json.loads(Path("out/report.json").read_text("utf-8"))
    assert (report["base"], report["diagnostics"][0]["code"]) == ("fixed", "rounded-angle")
    code, out, err = invoke("convert", urdf(child="c"), "-o", "bad")
    assert (code, out) == (2, "")
    assert "child link 'c'" in err
    assert not Path("bad").exists()


def test_help_and_usage_errors_load_nothing_heavy() -> None:
    script = (
        "import sys; sys.argv = ['twin', 'check', '--help']\n"
        "import twin.cli\n"
        "try: twin.cli.main()\n"
        "except SystemExit: pass\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, env={**os.environ}
    )
    assert done.stderr.strip() == "[]"
    assert "Example: twin check" in done.stdout
