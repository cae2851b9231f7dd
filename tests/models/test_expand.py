"""xacro in a process that can only read the model's own folders."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.errors import ModelError
from twin.models import ReadOptions, load
from twin.models.expand import expand

HEAD = "<robot name='r' xmlns:xacro='http://www.ros.org/wiki/xacro'>"


def write(folder: Path, body: str, name: str = "r.urdf.xacro") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / name
    file.write_text(f"{HEAD}{body}</robot>", encoding="utf-8")
    return file


def test_arguments_and_packages(tmp_path: Path) -> None:
    package = tmp_path / "parts"
    write(package, "<link name='wheel'/>", "wheel.xacro")
    body = "<xacro:arg name='n' default='a'/><link name='$(arg n)'/>"
    body += "<xacro:include filename='$(find parts)/wheel.xacro'/>"
    body += "<joint name='j' type='fixed'><parent link='$(arg n)'/><child link='wheel'/></joint>"
    file = write(tmp_path / "model", body)
    read = ReadOptions(args={"n": "base"}, packages={"parts": package})
    assert set(load(file, read).links) == {"base", "wheel"}
    with pytest.raises(ModelError, match=r"\$\(find parts\): package not found; known packages: twin_robots"):
        load(file)


def test_own_package_is_found_by_its_package_xml(tmp_path: Path) -> None:
    (tmp_path / "package.xml").write_text("<package><name>mine</name></package>", encoding="utf-8")
    write(tmp_path / "urdf", "<link name='a'/>", "part.xacro")
    file = write(tmp_path / "robots", "<xacro:include filename='$(find mine)/urdf/part.xacro'/>")
    assert load(file).root == "a"


def test_a_fault_after_expansion_names_element_and_source(tmp_path: Path) -> None:
    file = write(tmp_path, "<link name='a'/><link name='${1 + 1}'/>")
    with pytest.raises(ModelError) as caught:
        load(file)
    (problem,) = caught.value.problems
    assert problem.file == file
    assert problem.line is None
    assert "2 root links (a, 2)" in problem.message


def test_xacro_error_names_the_included_file(tmp_path: Path) -> None:
    part = write(tmp_path, "<link name='${nowhere}'/>", "part.xacro")
    file = write(tmp_path, "<xacro:include filename='part.xacro'/>")
    with pytest.raises(ModelError, match="nowhere") as caught:
        load(file)
    assert caught.value.problems[0].file in (part, file)


ATTACKS = {
    "reads elsewhere": "${xacro.load_yaml('/etc/hostname')}",
    "includes elsewhere": "<xacro:include filename='/etc/hostname'/>",
    "runs a program": "${(lambda: [c for c in ().__class__.__base__.__subclasses__()"
    " if c.__name__ == 'catch_warnings'][0]()._module.sys.modules['os'].posix_spawn('id', ['id'], {}))()}",
    "runs a shell": "${(lambda: [c for c in ().__class__.__base__.__subclasses__()"
    " if c.__name__ == 'catch_warnings'][0]()._module.sys.modules['os'].system('id'))()}",
    "reads the environment": "$(env HOME)",
}


@pytest.mark.parametrize("name", ATTACKS)
def test_a_model_cannot_reach_outside(tmp_path: Path, name: str) -> None:
    file = write(tmp_path, f"<link name='a'>{ATTACKS[name]}</link>")
    with pytest.raises(ModelError, match="xacro"):
        load(file)


def test_endless_expansion_is_stopped(tmp_path: Path) -> None:
    endless = "<xacro:macro name='m'><xacro:m/></xacro:macro><xacro:m/>"
    with pytest.raises(ModelError, match="without end"):
        load(write(tmp_path, endless))
    slow = write(tmp_path, "<link name='${len(str([x for x in range(10**9)]))}'/>", "slow.xacro")
    with pytest.raises(ModelError, match=r"xacro did not finish within 0\.5 s|more memory"):
        expand(slow, args={}, packages={}, time_limit_s=0.5)
