from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Invoke

# The files and the output of ros2cli's own tests (ros2interface/test/test_cli.py).
FILES = {
    "msg/ShortVaried.msg": (
        "# A constant\nbool BOOL_CONST=true # Comment - Nesting Level 1: 1 of 2\n\n"
        "# Bool and array of bools\n"
        "bool bool_value\nbool[<=3] bool_values # Comment - Nesting Level 1: 2 of 2\n\n# Trailing comment\n"
    ),
    "msg/ShortVariedNested.msg": (
        "# A short, varied type\nShortVaried short_varied # Comment - Nesting Level 2: 1 of 1\n"
        "# Trailing comment\n"
    ),
    "msg/ShortVariedMultiNested.msg": (
        "# A short, varied, and nested type\n"
        "ShortVariedNested short_varied_nested # Comment - Nesting Level 3: 1 of 1\n# Trailing comment\n"
    ),
    "srv/ShortVariedMultiNested.srv": (
        "# Request\nShortVariedNested short_varied_nested # Comment - Nesting Level 3: 1 of 2\n---\n"
        "# Response\nbool bool_value # Comment - Nesting Level 3: 2 of 2\n"
    ),
}
NESTED = (
    "\tShortVaried short_varied\n\t\tbool BOOL_CONST=true\n\t\tbool bool_value\n\t\tbool[<=3] bool_values\n"
)

Here = Callable[..., str]


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("ws") / "ros2cli_test_interfaces"
    for name, text in FILES.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return root


def run(*arguments: str, given: str = "", **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "twin.cli", "interface", *arguments],
        input=given,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def printed(*arguments: str, **more: str) -> str:
    done = run(*arguments, **more)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def here(invoke: Invoke) -> Here:
    """As `printed`, in this process and so in no time: for what leaves no types of its own behind."""

    def call(*arguments: str) -> str:
        code, out, errors = invoke("interface", *arguments)
        assert code == 0, errors
        return out

    return call


def test_show(package: Path) -> None:
    name = "ros2cli_test_interfaces/msg/ShortVariedMultiNested"
    own = ["--interfaces", str(package)]
    assert printed("show", name, *own) == (
        "# A short, varied, and nested type\n"
        "ShortVariedNested short_varied_nested # Comment - Nesting Level 3: 1 of 1\n"
        f"{NESTED}# Trailing comment\n"
    )
    assert printed("show", name, "--no-comments", *own) == f"ShortVariedNested short_varied_nested\n{NESTED}"
    assert printed("show", name, "--all-comments", *own) == (
        "# A short, varied, and nested type\n"
        "ShortVariedNested short_varied_nested # Comment - Nesting Level 3: 1 of 1\n"
        "\t# A short, varied type\n\tShortVaried short_varied # Comment - Nesting Level 2: 1 of 1\n"
        "\t\t# A constant\n\t\tbool BOOL_CONST=true # Comment - Nesting Level 1: 1 of 2\n\n"
        "\t\t# Bool and array of bools\n\t\tbool bool_value\n"
        "\t\tbool[<=3] bool_values # Comment - Nesting Level 1: 2 of 2\n\n\t\t# Trailing comment\n"
        "\t# Trailing comment\n# Trailing comment\n"
    )


def test_a_service_from_the_environment_and_the_name_from_a_pipe(package: Path) -> None:
    shown = printed(
        "show",
        "-",
        given="ros2cli_test_interfaces/srv/ShortVariedMultiNested\n",
        TWIN_INTERFACES=os.pathsep.join([str(package), str(package.parent)]),
    )
    assert shown == (
        "# Request\nShortVariedNested short_varied_nested # Comment - Nesting Level 3: 1 of 2\n"
        f"{NESTED}---\n# Response\nbool bool_value # Comment - Nesting Level 3: 2 of 2\n"
    )


def test_lists(package: Path, here: Here) -> None:
    everything = printed("list", "--interfaces", str(package)).splitlines()
    assert [line for line in everything if not line.startswith("    ")] == [
        "Messages:",
        "Services:",
        "Actions:",
    ]
    assert "    ros2cli_test_interfaces/srv/ShortVariedMultiNested" in everything
    assert "    example_interfaces/action/Fibonacci" in everything
    assert here("list", "-a").startswith("Actions:\n    action_tutorials_interfaces/action/Fibonacci\n")
    assert here("package", "std_srvs") == "std_srvs/srv/Empty\nstd_srvs/srv/SetBool\nstd_srvs/srv/Trigger\n"
    assert here("package", "tf2_msgs", "-s", "-m") == (
        "tf2_msgs/msg/TF2Error\ntf2_msgs/msg/TFMessage\ntf2_msgs/srv/FrameGraph\n"
    )
    assert {"nav2_msgs", "turtlesim"} <= set(here("packages", "-a").splitlines())
    assert "sensor_msgs" not in here("packages", "-a").splitlines()


def test_prototypes(here: Here) -> None:
    vector = "  x: 0.0\n  y: 0.0\n  z: 0.0\n"
    assert here("proto", "geometry_msgs/msg/Twist") == f'"linear:\n{vector}angular:\n{vector}"\n'
    assert here("proto", "example_interfaces/srv/AddTwoInts", "--no-quotes") == "a: 0\nb: 0\n\n"
    assert here("proto", "example_interfaces/action/Fibonacci") == '"order: 0\n"\n'


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["show", "geometry_msgs/msg/Twits"], "did you mean 'geometry_msgs/msg/Twist'"),
        (["show", "Twist"], "not a type name"),
        (["package", "not_a_package"], "Unknown package 'not_a_package'"),
        (["list", "--interfaces", "nowhere"], "there is no folder nowhere"),
        (["show", "std_msgs/msg/String", "--all-comments", "--no-comments"], "--no-comments"),
    ],
)
def test_a_mistake_is_one_sentence(arguments: list[str], said: str, invoke: Invoke) -> None:
    code, _, errors = invoke("interface", *arguments)
    assert code == 2
    assert said in " ".join(errors.split())
    assert "Traceback" not in errors


def test_all_faults_of_a_folder_with_their_lines(tmp_path: Path) -> None:
    for name, text in {"A.msg": "int32 a\nint33 b\nint8 c=\n", "B.msg": "A a\nint8 X=1000\n"}.items():
        (tmp_path / "bad_msgs" / "msg").mkdir(parents=True, exist_ok=True)
        (tmp_path / "bad_msgs" / "msg" / name).write_text(text)
    done = run("list", "--interfaces", str(tmp_path))
    assert done.returncode == 2
    text = done.stderr.replace("\n", "")
    assert [where in text for where in ("A.msg:2", "A.msg:3", "B.msg:2")] == [True] * 3
