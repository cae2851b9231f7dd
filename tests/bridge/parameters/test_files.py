from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from twin.bridge.bus import Bus
from twin.bridge.msgs import Log, String
from twin.bridge.node.options import NodeOptions
from twin.bridge.parameters import files as parameter_files
from twin.bridge.programs import ros_args
from twin.errors import BridgeError

FILE = """\
/**:
  ros__parameters:
    use_intra_process: yes
    rate: 1.
amcl:
  ros__parameters: {rate: 2.0, laser: {range: 1e-1, beams: 0x10}}
robot:
  amcl:
    ros__parameters:
      rate: 3.0
      names: [a, "1"]
      id: !!str 12
/*/amcl:
  ros__parameters: {rate: 9.0, star: true}
/robot/**:
  ros__parameters: {deep: -7}
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "params.yaml"
    path.write_text(text)
    return path


def test_a_nodes_values_come_from_wildcards_and_then_from_its_name(tmp_path: Path) -> None:
    sections = parameter_files.read(write(tmp_path, FILE))
    assert parameter_files.values_for(sections, "/amcl") == {
        "use_intra_process": True,
        "rate": 2.0,
        "laser.range": 0.1,
        "laser.beams": 16,
    }
    robot = parameter_files.values_for(sections, "/robot/amcl")
    assert robot == {
        "use_intra_process": True,
        "rate": 3.0,
        "star": True,
        "deep": -7,
        "names": ["a", "1"],
        "id": "12",
    }
    assert parameter_files.values_for(sections, "/robot/a/b")["deep"] == -7
    assert "star" not in parameter_files.values_for(sections, "/a/robot/amcl")
    assert "deep" not in parameter_files.values_for(sections, "/robot2/a")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1),
        ("-1", -1),
        ("1.", 1.0),
        (".5", 0.5),
        ("1e3", 1000.0),
        ("010", 8),
        ("y", True),
        ("off", False),
        ("'1'", "1"),
        ("[1.0, 2.5]", [1.0, 2.5]),
        ("a b", "a b"),
        ("-.inf", float("-inf")),
        ("", ""),
        ("1.2.3", "1.2.3"),
    ],
)
def test_scalars_are_read_as_rcl_reads_them(text: str, value: Any) -> None:
    assert (parameter_files.scalar(text), type(parameter_files.scalar(text))) == (value, type(value))


@pytest.mark.parametrize(
    ("pattern", "matching", "others"),
    [
        ("/**", ["/a", "/a/b/c"], []),
        ("/*", ["/a", "/b"], ["/a/b"]),
        ("/**/amcl", ["/amcl", "/a/amcl", "/a/b/amcl"], ["/amcl2", "/a/xamcl", "/amcl/a"]),
        ("/*/amcl", ["/a/amcl"], ["/amcl", "/a/b/amcl"]),
        ("/a/**", ["/a/b", "/a/b/c"], ["/ab", "/b/a"]),
        ("/a/*/c", ["/a/b/c"], ["/a/c", "/a/b/b/c"]),
        ("/a/**/c", ["/a/c", "/a/b/c", "/a/b/b/c"], ["/ac", "/c"]),
    ],
)
def test_wildcards_are_those_of_ros(pattern: str, matching: list[str], others: list[str]) -> None:
    """As the regular expressions of rclcpp (parameter_map.cpp): * is one name, ** any number."""
    section = parameter_files.Section(pattern, {})
    assert [name for name in (*matching, *others) if section.matches(name)] == matching


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: [", r"params\.yaml:1: no YAML"),
        ("amcl: 5", r"params\.yaml:1: /amcl is no mapping"),
        ("ros__parameters: {a: 1}", "below no node name"),
        ("a:\n  ros__parameters:\n    x: [1, 2.0]", r"params\.yaml:3: a list holds values of one type"),
        ("a:\n  ros__parameters:\n    x:", r"params\.yaml:3: there is no value"),
        ("a:\n  ros__parameters:\n    x: [[1]]", r"params\.yaml:3: a parameter is a scalar"),
        ("a: {ros__parameters: {x: 9223372036854775808}}", "64 bits"),
        ("a: &a {b: *a}", "nested deeper"),
        ("[a]", "the file is no mapping"),
        (
            "/**:\n  amc*:\n    ros__parameters: {x: 1}",
            r"params\.yaml:3: /\*\*/amc\*: \* stands for one whole",
        ),
    ],
)
def test_bad_files_are_told_by_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(BridgeError, match=message):
        parameter_files.read(write(tmp_path, text))


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(BridgeError, match="cannot be read: No such file"):
        parameter_files.read(tmp_path / "no.yaml")


def test_an_empty_file_says_nothing(tmp_path: Path) -> None:
    assert parameter_files.read(write(tmp_path, "")) == ()


def test_a_program_takes_what_its_arguments_say(bus: Bus, tmp_path: Path) -> None:
    path = write(tmp_path, "/**: {ros__parameters: {rate: 5.0, name: file}}")
    text = (
        f"run --fast --ros-args -r __node:=speaker --remap __ns:=/r -r chatter:=~/out --params-file {path} "
        "-p rate:=7 -p other:rate:=9 --log-level warn --log-level r.speaker.child:=debug -- tail"
    )
    arguments = ros_args.parse(text.split())
    assert arguments.rest == ("run", "--fast", "tail")
    node = bus.create_node("talker", options=NodeOptions(arguments=arguments))
    assert node.fully_qualified_name == "/r/speaker"
    assert node.declare_parameter("rate", 1.0).value == 7.0
    assert node.declare_parameter("name", "default").value == "file"
    assert node.create_publisher(String, "chatter").name == "/r/speaker/out"
    log = node.get_logger()
    assert log.get_effective_level() == Log.WARN
    assert log.get_child("child").get_effective_level() == Log.DEBUG


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("--ros-args -x", "'-x' after --ros-args is not known"),
        ("--ros-args --remap", "nothing follows --remap"),
        ("--ros-args -r a:b", "'a:b' is no remapping; valid: from:=to"),
        ("--ros-args -r __node:=1x", "'1x' is not a node name"),
        ("--ros-args -p a=1", "'a=1' is no parameter"),
        ("--ros-args --log-level loud", "'loud' is no log level; valid: UNSET, DEBUG"),
    ],
)
def test_bad_arguments_are_told(text: str, message: str) -> None:
    with pytest.raises(BridgeError, match=message):
        ros_args.parse(text.split())
