"""ROS packages are found without ROS, and files only where a robot file may read."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.oracles.installed import example_robots
from twin.errors import ModelError
from twin.models import ReadOptions, load
from twin.models.urdf.document import Report, parse
from twin.models.urdf.packages import PackagePath, Packages, locate

STL = b"\0" * 84
LINK = "<link name='a'><visual><geometry><mesh filename='{}'/></geometry></visual></link>"


def package(folder: Path, name: str = "") -> Path:
    """Make a package with meshes/arm.stl."""
    (folder / "meshes").mkdir(parents=True)
    (folder / "package.xml").write_text(
        f"<package><!-- <name>no</name> --><name> {name or folder.name} </name></package>"
    )
    (folder / "meshes" / "arm.stl").write_bytes(STL)
    return folder


def robot(folder: Path, mesh: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "r.urdf"
    file.write_text(f"<robot name='r'>\n{LINK.format(mesh)}</robot>")
    return file


def mesh_of(file: Path, options: ReadOptions | None = None) -> Path:
    geometry = load(file, options or ReadOptions()).links["a"].visuals[0].geometry
    path: Path = geometry.path  # type: ignore[union-attr]
    return path


def fault(file: Path, options: ReadOptions | None = None) -> tuple[str, str]:
    with pytest.raises(ModelError) as caught:
        load(file, options or ReadOptions())
    (problem,) = caught.value.problems
    assert problem.line == 2
    return problem.code, problem.message


@pytest.mark.parametrize(
    "reference",
    [
        "package://arm_description/meshes/arm.stl",
        "package:///arm_description/meshes/arm.stl",
        "package://arm_description//meshes/arm.stl",
        "package://folder/meshes/arm.stl",
        "model://arm_description/meshes/arm.stl",
        "PACKAGE://arm_description/meshes/arm.stl",
        "../meshes/arm.stl",
        "file://../meshes/arm.stl",
        "file://{folder}/meshes/arm.stl",
        "{folder}/meshes/arm.stl",
    ],
)
def test_own_package_has_two_names_and_several_spellings(tmp_path: Path, reference: str) -> None:
    folder = package(tmp_path / "folder", "arm_description")
    file = robot(folder / "urdf", reference.format(folder=folder))
    assert mesh_of(file).samefile(folder / "meshes" / "arm.stl")


def test_packages_above_beside_and_in_the_workspace(tmp_path: Path) -> None:
    source = tmp_path / "ws" / "src"
    own = package(source / "group" / "own")
    inner = package(own / "third_party" / "inner")
    beside, far = package(source / "group" / "beside"), package(source / "other" / "deep" / "far")
    for folder in (own, inner, beside, far):
        file = robot(inner / "urdf", f"package://{folder.name}/meshes/arm.stl")
        assert mesh_of(file).samefile(folder / "meshes" / "arm.stl")
    (source / "other" / "COLCON_IGNORE").touch()
    code, message = fault(file)
    assert code == "missing-mesh"
    assert "no package 'far'; known packages: inner, own, twin_robots (give --package far=PATH)" in message


def test_packages_of_the_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    installed, sources = tmp_path / "opt" / "jazzy", tmp_path / "catkin"
    a = package(installed / "share" / "a")
    b = package(sources / "stack" / "b")
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"/nowhere:{installed}")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(sources))
    for folder in (a, b):
        file = robot(tmp_path / "robot", f"package://{folder.name}/meshes/arm.stl")
        assert mesh_of(file) == folder / "meshes" / "arm.stl"
    monkeypatch.delenv("ROS_PACKAGE_PATH")
    assert fault(file)[0] == "missing-mesh"


def test_a_workspace_installed_by_symbolic_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source, share = package(tmp_path / "src" / "arm"), tmp_path / "install" / "share" / "arm"
    for name in ("package.xml", "meshes/arm.stl"):
        (share / name).parent.mkdir(parents=True, exist_ok=True)
        (share / name).symlink_to(source / name)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "install"))
    file = robot(tmp_path / "elsewhere", "package://arm/meshes/arm.stl")
    assert mesh_of(file).samefile(source / "meshes" / "arm.stl")


def test_a_given_package_wins(tmp_path: Path) -> None:
    own, other = package(tmp_path / "own"), package(tmp_path / "elsewhere" / "other", "own")
    file = robot(own / "urdf", "package://own/meshes/arm.stl")
    assert mesh_of(file, ReadOptions(packages={"own": other})) == other / "meshes" / "arm.stl"
    with pytest.raises(ModelError, match="package 'own': no such folder"):
        load(file, ReadOptions(packages={"own": tmp_path / "nowhere"}))


@pytest.mark.parametrize(
    "reference",
    [
        "file:///etc/hostname",
        "file:/etc/hostname",
        "/etc/hostname",
        "../../../../../../../../etc/hostname",
        "package://own/../../../../../../../../etc/hostname",
        "package:///own/../secret.stl",
        "../secret.stl",
        "link.stl",
        "folder/hostname",
    ],
)
def test_meshes_outside_are_refused(tmp_path: Path, reference: str) -> None:
    own = package(tmp_path / "own")
    (tmp_path / "secret.stl").write_bytes(STL)
    (own / "link.stl").symlink_to(tmp_path / "secret.stl")
    (own / "folder").symlink_to("/etc")
    code, message = fault(robot(own, reference))
    assert code == "outside-path"
    assert f"mesh '{reference}' of link 'a' is outside of the file's folder and packages" in message
    assert "give --allow-path /" in message


def test_a_mesh_in_an_allowed_folder(tmp_path: Path) -> None:
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "arm.stl").write_bytes(STL)
    file = robot(tmp_path / "urdf", f"file://{tmp_path}/meshes/arm.stl")
    assert fault(file)[0] == "outside-path"
    assert mesh_of(file, ReadOptions(allow_paths=(tmp_path / "meshes",))).is_file()


@pytest.mark.parametrize(
    ("reference", "reason"),
    [
        ("http://example.com/arm.stl", "is no local file"),
        ("package://own/meshes/leg.stl", "does not exist"),
        ("package://", "no package ''"),
        ("a" * 300, "mesh 'aaa"),
    ],
)
def test_meshes_that_are_not_there(tmp_path: Path, reference: str, reason: str) -> None:
    code, message = fault(robot(package(tmp_path / "own"), reference))
    assert code == "missing-mesh"
    assert reason in message


def test_names_are_looked_up_only_when_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = package(tmp_path / "own")
    monkeypatch.setenv("ROS_PACKAGE_PATH", "/")
    packages = Packages(PackagePath.of(robot(own, "arm.stl"), ReadOptions()))
    assert packages["own"] == own
    assert list(packages) == ["own", "twin_robots"]


@pytest.mark.skipif(not example_robots(), reason="example-robot-data is not installed")
def test_example_robot_data_finds_its_meshes() -> None:
    missing = {}
    for file in example_robots():
        packages = Packages(PackagePath.of(file, ReadOptions()))
        for mesh in parse(file.read_bytes(), Report(file)).iter("mesh"):
            found = locate(mesh.get("filename"), file, packages)
            if found.path is None:
                missing[file.name, found.code] = mesh.get("filename")
    # Its meshes are in a folder of the SDK of the robot's maker: file:///usr/Romeo/...
    assert list(missing) == [("romeo_laas_small.urdf", "missing-mesh")]
