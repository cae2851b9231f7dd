from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest
import yaml

from twin.cli.ros.param import value_of

GRAPH = "service_graph.py"
NAMES = [
    "anything",
    "camera_on",
    "gains.limits",
    "gains.p",
    "max_speed",
    "names",
    "robot_name",
    "serial",
    "start_type_description_service",
    "use_sim_time",
    "version",
    "wheels",
]

Twin = Callable[..., "CompletedProcess[str]"]


def test_the_parameters_of_a_node_are_listed(twin_here: Twin) -> None:
    done = twin_here("param", "list", "/settings")
    assert done.stderr == ""
    assert done.stdout.split() == NAMES
    assert done.stdout.startswith("  anything\n  camera_on\n")


def test_the_parameters_of_all_nodes_are_listed_below_their_names(twin_here: Twin) -> None:
    lines = twin_here("param", "list").stdout.splitlines()
    nodes = [line for line in lines if not line.startswith("  ")]
    assert nodes == ["/adder:", "/fibonacci_action_server:", "/lab:", "/robot/base:", "/settings:"]
    assert lines[lines.index("/settings:") + 1 :] == [f"  {name}" for name in NAMES]


def test_a_list_is_filtered_and_tells_types(twin_here: Twin) -> None:
    typed = twin_here("param", "list", "settings", "--filter", "(gains|wheels)", "--param-type").stdout
    assert typed == (
        "  gains.limits (type: double array)\n  gains.p (type: double)\n  wheels (type: integer)\n"
    )
    below = twin_here("param", "list", "/settings", "--param-prefixes", "gains").stdout
    assert below == "  gains.limits\n  gains.p\n"


@pytest.mark.parametrize(
    ("name", "printed"),
    [
        ("robot_name", "String value is: r2d2"),
        ("camera_on", "Boolean value is: True"),
        ("wheels", "Integer value is: 4"),
        ("gains.p", "Double value is: 1.5"),
        ("gains.limits", "Double values are: [0.5, 1.0]"),
        ("names", "String values are: ['a', '1']"),
    ],
)
def test_a_value_is_printed_with_its_type(twin_here: Twin, name: str, printed: str) -> None:
    assert twin_here("param", "get", "/settings", name).stdout == f"{printed}\n"


def test_a_value_is_printed_without_its_type(twin_here: Twin) -> None:
    assert twin_here("param", "get", "/settings", "gains.limits", "--hide-type").stdout == "[0.5, 1.0]\n"


def test_a_parameter_is_changed(twin_here: Twin) -> None:
    assert twin_here("param", "set", "/settings", "max_speed", "1.25").stdout == "Set parameter successful\n"
    assert twin_here("param", "get", "/settings", "max_speed").stdout == "Double value is: 1.25\n"


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("max_speed", "9.0", "out of range"),
        ("max_speed", "-1.0", "out of range"),
        ("serial", "8", "read-only"),
        ("robot_name", "5", "type"),
        ("wheel", "5", "wheel"),
    ],
)
def test_a_change_that_the_node_refuses_says_why(twin_here: Twin, name: str, value: str, reason: str) -> None:
    done = twin_here("param", "set", "/settings", name, value)
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.startswith("Setting parameter failed: ")
    assert reason in done.stderr


def test_text_becomes_a_value_by_the_rules_of_ros2_param_set() -> None:
    texts = [
        "1",
        "1.0",
        "true",
        "on",
        "hello",
        "'1'",
        "[1, 2]",
        "[1.5]",
        "[a, b]",
        "[1, a]",
        "[]",
        "",
        "{a: 1}",
    ]
    assert [value_of(text) for text in texts] == [
        *(1, 1.0, True, True, "hello", "1", [1, 2], [1.5], ["a", "b"], "[1, a]", [], "", "{a: 1}")
    ]


def test_a_parameter_is_described(twin_here: Twin) -> None:
    assert twin_here("param", "describe", "/settings", "max_speed", "serial").stdout == (
        "Parameter name: max_speed\n"
        "  Type: double\n"
        "  Description: Of the wheels\n"
        "  Constraints:\n"
        "    Min value: 0.0\n"
        "    Max value: 2.0\n"
        "Parameter name: serial\n"
        "  Type: integer\n"
        "  Constraints:\n"
        "    Read only: true\n"
    )


def test_a_dump_can_be_loaded_again_type_by_type(twin_here: Twin, tmp_path: Path) -> None:
    file = tmp_path / "settings.yaml"
    dumped = twin_here("param", "dump", "/settings")
    assert dumped.stderr == ""
    values = yaml.safe_load(dumped.stdout)["/settings"]["ros__parameters"]
    assert values["gains"] == {"limits": [0.5, 1.0], "p": 1.5}
    assert "version: '1e-3'" in dumped.stdout  # quoted: text for ROS too
    file.write_text(dumped.stdout.replace("wheels: 4", "wheels: 6").replace("r2d2", "c3po"))
    loaded = twin_here("param", "load", "/settings", str(file))
    assert loaded.returncode == 1
    assert "Set parameter wheels successful\n" in loaded.stdout
    assert loaded.stderr.startswith("Set parameter serial failed: ")
    assert twin_here("param", "get", "/settings", "wheels").stdout == "Integer value is: 6\n"
    assert twin_here("param", "get", "/settings", "version").stdout == "String value is: 1e-3\n"


def test_wildcards_of_a_file_count_unless_refused(twin_here: Twin, tmp_path: Path) -> None:
    file = tmp_path / "all.yaml"
    file.write_text(
        "/**:\n  ros__parameters:\n    anything: 5\n/other:\n  ros__parameters:\n    anything: 6\n"
    )
    assert twin_here("param", "load", "/settings", str(file)).stdout == "Set parameter anything successful\n"
    refused = twin_here("param", "load", "/settings", str(file), "--no-use-wildcard")
    assert refused.returncode == 2
    assert "does not contain parameters for /settings, only for nodes: /other" in refused.stderr


def test_a_parameter_is_deleted_if_the_node_allows_it(twin_here: Twin) -> None:
    assert twin_here("param", "delete", "/settings", "anything").stdout == "Deleted parameter successfully\n"
    refused = twin_here("param", "delete", "/settings", "serial")
    assert refused.returncode == 1
    assert refused.stderr.startswith("Deleting parameter failed: ")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("get", "/setings", "wheels", "--timeout", "2"),
            "Node not found: /setings; did you mean '/settings'?",
        ),
        (("get", "/settings", "whels"), "/settings has no parameter 'whels'; did you mean 'wheels'?"),
        (
            ("describe", "/settings", "wheels", "whels"),
            "/settings has no parameter 'whels'; did you mean 'wheels'?",
        ),
        (("list", "/settings", "--filter", "("), "is no regular expression"),
    ],
)
def test_what_is_not_there_is_a_sentence_with_the_nearest_name(
    twin_here: Twin, arguments: tuple[str, ...], message: str
) -> None:
    done = twin_here("param", *arguments)
    assert done.returncode == 2
    assert done.stderr.startswith("error: ")
    assert message in done.stderr
