from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from twin.bridge import types
from twin.bridge.cdr.codec import codec
from twin.bridge.msgs import PoseStamped, new
from twin.bridge.types.text import show_lines
from twin.errors import BridgeError

Write = Callable[..., Path]
_numbers = itertools.count()


@pytest.fixture
def package() -> str:
    """A name that no other test has: definitions stay known."""
    return f"course{next(_numbers)}_msgs"


@pytest.fixture
def write(tmp_path: Path, package: str) -> Iterator[Write]:
    def write_file(name: str, text: str, folder: Path | None = None) -> Path:
        root = folder or tmp_path / package
        file = root / Path(name).suffix[1:] / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
        return root

    return write_file


def test_the_types_of_the_course(write: Write, package: str) -> None:
    write("gps.msg", "float32 x\nfloat32 y\nstring state\n")
    write("Greeting.srv", "string name\nint32 age\n---\nstring feedback\n")
    write(
        "DoDishes.action",
        "# Define the goal\nuint32 dishwasher_id  # Specify which dishwasher we want to use\n---\n"
        "# Define the result\nuint32 total_dishes_cleaned\n---\n"
        "# Define a feedback message\nfloat32 percent_complete\n",
    )
    root = write(
        "MoveBase.action",
        "geometry_msgs/PoseStamped target_pose\n---\n---\ngeometry_msgs/PoseStamped base_position\n",
    )
    assert types.add_folder(root) == [
        f"{package}/action/DoDishes",
        f"{package}/action/MoveBase",
        f"{package}/msg/gps",
        f"{package}/srv/Greeting",
    ]
    gps = types.get(f"{package}/gps")
    one = codec(gps)
    assert one.decode(one.encode(gps(1.5, 2.5, "fix"))) == gps(1.5, 2.5, "fix")
    assert types.dds_name(f"{package}/msg/gps") == f"{package}::msg::dds_::gps_"
    greeting = types.ServiceType(f"{package}/srv/Greeting")
    assert new(greeting.Request, name="Ann").age == 0
    dishes = types.ActionType(f"{package}/action/DoDishes")
    assert new(dishes.FeedbackMessage).feedback == dishes.Feedback(0.0)
    assert types.ActionType(f"{package}/action/MoveBase").Goal(new(PoseStamped)).target_pose == new(
        PoseStamped
    )
    assert types.rihs01(f"{package}/action/DoDishes").startswith("RIHS01_")


def test_words_of_ros_1_mean_what_took_their_place(write: Write, package: str) -> None:
    text = "Header header\ntime at\nduration[2] took\nduration[] more\nfloat32 x\n"
    types.add_folder(write("Old.msg", text))
    new_text = (
        "std_msgs/Header header\nbuiltin_interfaces/Time at\nbuiltin_interfaces/Duration[2] took\n"
        "builtin_interfaces/Duration[] more\nfloat32 x\n"
    )
    types.register(f"{package}/msg/Old", new_text)
    assert len(new(types.get(f"{package}/msg/Old")).took) == 2


def test_every_default_of_rosidls_own_test_message() -> None:
    types.add_folder(Path(__file__).parents[1] / "data" / "test_msgs")
    arrays = new(types.get("test_msgs/msg/Arrays"))
    assert arrays.int64_values_default.tolist() == [0, 2**63 - 1, -(2**63)]
    assert arrays.uint64_values_default.tolist() == [0, 1, 2**64 - 1]
    assert arrays.float32_values_default.dtype == np.float32
    assert arrays.string_values_default == ["", "max value", "min value"]
    assert arrays.byte_values_default.view(np.uint8).tolist() == [0, 1, 255]
    assert arrays.bool_values_default.tolist() == [False, True, False]
    strings = new(types.get("test_msgs/msg/Strings"))
    assert strings.string_value_default2 == strings.string_value_default4 == "Hello'world!"
    assert strings.string_value_default3 == strings.string_value_default5 == 'Hello"world!'
    assert strings.STRING_CONST == "Hello world!"
    assert new(types.get("test_msgs/msg/WStrings")).wstring_value_default3 == "ハローワールド"
    first, second = new(types.get("test_msgs/msg/Arrays")), new(types.get("test_msgs/msg/Arrays"))
    first.int32_values_default[0] = 7
    first.string_values_default[0] = "changed"
    assert second.int32_values_default[0] == 0
    assert second.string_values_default[0] == ""


def test_constants_defaults_and_comments(write: Write, package: str) -> None:
    text = (
        "\ufeff# Straße # und # mehr\n\n"
        "int8 LOW=-128 # lowest\nuint8 HEX = 0xff\nstring HASH='a # b'\nstring BARE=it's free # comment\n"
        "float64 PI=3.14159\nbool ON=True\nchar C=65\n"
        'string greeting "say # this" # comment\nfloat64[3] weights [0.5,1, 1.5]\n'
        "string[] names ['a, b', \"c\"]\n"
        '\tint32\tcount\t-5\nint32 from\nstring<=5 short "abcde"\nbool[<=2] flags [true, 0]\n'
    )
    types.add_folder(write("Rich.msg", text))
    rich = types.get(f"{package}/msg/Rich")
    assert (rich.LOW, rich.HEX, rich.HASH, rich.BARE, rich.ON, rich.C) == (
        -128,
        255,
        "a # b",
        "it's free",
        True,
        65,
    )
    made = new(rich)
    assert (made.greeting, made.count, made.short, made.from_) == ("say # this", -5, "abcde", 0)
    assert made.weights.tolist() == [0.5, 1.0, 1.5]
    assert (made.names, made.flags.tolist()) == (["a, b", "c"], [True, False])


def test_all_faults_are_told_at_once_with_their_lines(write: Write, package: str) -> None:
    write("Bad.srv", "int32 a\n")
    root = write(
        "Bad.msg",
        "flaot32 x\ngeometry_msgs/Piont p\nint32 camelCase\nint8 a\nint8 a\nint8 TOO_BIG=300\nint32[0] none\n"
        "int32[x] what\nint8 lower=1\nPoint b 5\nint32\nstring<=x s\nfloat32<=3 f\nint8[2] c [1]\n"
        "int8 d 1.5\nBad\n",
    )
    with pytest.raises(BridgeError) as caught:
        types.add_folder(root)
    told = [(p.file.name if p.file else "", p.line, p.message) for p in caught.value.problems]
    said = [
        ("Bad.msg", 3, "'camel_case'"),
        ("Bad.msg", 5, "twice"),
        ("Bad.msg", 6, "300 is out of range; valid for int8: a whole number from -128 to 127"),
        ("Bad.msg", 7, "bound '0'"),
        ("Bad.msg", 8, "bound 'x'"),
        ("Bad.msg", 9, "no name of a constant"),
        ("Bad.msg", 10, "cannot have a default"),
        ("Bad.msg", 11, "neither a field nor a constant"),
        ("Bad.msg", 12, "bound 'x'"),
        ("Bad.msg", 13, "only string and wstring"),
        ("Bad.msg", 14, "1 elements; valid: exactly 2"),
        ("Bad.msg", 15, "'1.5' is no whole number"),
        ("Bad.msg", 16, "neither a field nor a constant"),
        ("Bad.msg", 1, "did you mean 'float32'"),
        ("Bad.msg", 2, "did you mean 'geometry_msgs/msg/Point'"),
        ("Bad.srv", 1, "1 sections; valid for .srv: 2, with lines of --- between"),
    ]
    missing = [want for want in said if not any(want[:2] == got[:2] and want[2] in got[2] for got in told)]
    assert missing == [], told
    assert f"{package}/msg/Bad" not in types.names()


def test_a_type_that_contains_itself(write: Write, package: str) -> None:
    write("A.msg", "B[] b\n")
    types.add_folder(write("B.msg", "A a\n"))
    with pytest.raises(BridgeError, match=rf"{package}/msg/A contains itself: .*A -> .*B -> .*A"):
        types.get(f"{package}/msg/A")


def test_a_type_that_contains_itself_is_not_shown_for_ever(write: Write, package: str) -> None:
    types.add_folder(write("Tree.msg", f"{package}/Tree[] branches\n"))
    with pytest.raises(BridgeError, match=rf"{package}/msg/Tree contains itself: "):
        list(show_lines(f"{package}/msg/Tree"))


def test_two_definitions_of_a_name_are_an_error_that_names_both(
    write: Write, package: str, tmp_path: Path
) -> None:
    first = write("Thing.msg", "int32 a  # one\n", tmp_path / "one" / package)
    same = write("Thing.msg", "# two\nint32   a\n", tmp_path / "two" / package)
    other = write("Thing.msg", "int64 a\n", tmp_path / "three" / package)
    types.add_folders([first, same])
    with pytest.raises(BridgeError) as caught:
        types.add_folder(other)
    assert str(other / "msg" / "Thing.msg") in str(caught.value)
    assert "Thing.msg" in str(caught.value).split("another definition")[1]
    with pytest.raises(BridgeError, match="another definition: ROS's own"):
        types.add_folder(write("Twist.msg", "float64 speed\n", tmp_path / "geometry_msgs"))
    types.add_folder(
        write("Point.msg", "# mine\nfloat64 x\nfloat64 y\nfloat64 z\n", tmp_path / "x" / "geometry_msgs")
    )


def test_packages_are_found_where_colcon_and_ament_have_them(
    write: Write, package: str, tmp_path: Path
) -> None:
    workspace = tmp_path / "ws"
    write("Part.msg", "int32 a\n", workspace / "src" / "deep" / "Folder")
    manifest = workspace / "src" / "deep" / "Folder" / "package.xml"
    manifest.write_text(
        f'<?xml version="1.0"?>\n<package format="3">\n  <name>{package}</name>\n</package>\n'
    )
    installed = workspace / "install" / package / "share" / package
    write("Part.msg", "int32 a\n", installed)
    (installed / "msg" / "Part.idl").write_text("module x {};")
    ignored = write("Part.msg", "int64 other\n", workspace / "build" / package)
    (ignored.parent / "COLCON_IGNORE").touch()
    write("User.msg", f"{package}/Part part\n", workspace / "src" / f"{package}_more")
    assert types.add_folder(workspace) == [f"{package}/msg/Part", f"{package}_more/msg/User"]
    assert types.add_folder(installed / "msg") == [f"{package}/msg/Part"]
    assert new(types.get(f"{package}_more/msg/User")).part.a == 0


@pytest.mark.parametrize(
    ("files", "said"),
    [
        ([], "there is no folder"),
        (["good_msgs/readme.txt"], "holds no interfaces"),
        (["Bad-Name/msg/A.msg"], "'Bad-Name' is no name of a package"),
        (["good_msgs/msg/not-good.msg"], "no name of a type"),
        (["good_msgs/msg/Latin.msg"], "cannot be read as UTF-8"),
    ],
)
def test_folders_that_cannot_be_used(tmp_path: Path, files: list[str], said: str) -> None:
    root = tmp_path / "given"
    for name in files:
        (root / name).parent.mkdir(parents=True)
        (root / name).write_bytes(b"int32 a # \xe9\n" if "Latin" in name else b"int32 a\n")
    with pytest.raises(BridgeError, match=said):
        types.add_folder(root)


def test_a_long_array_of_messages_is_refused(package: str) -> None:
    with pytest.raises(BridgeError, match="too long"):
        types.register(f"{package}/msg/Long", "geometry_msgs/Point[100000000] points\n")
