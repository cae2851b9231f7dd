"""xacro in a process that can only read the model's own folders, and lines after it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from twin.errors import ModelError
from twin.models import ReadOptions, load
from twin.models.checks import check
from twin.models.expansion.expand import expand

HEAD = "<robot name='r' xmlns:xacro='http://www.ros.org/wiki/xacro'>"


def write(folder: Path, body: str, name: str = "r.urdf.xacro") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / name
    file.write_text(f"{HEAD}{body}</robot>", encoding="utf-8")
    return file


def fault(file: Path, options: ReadOptions | None = None) -> str:
    with pytest.raises(ModelError) as caught:
        load(file, options or ReadOptions())
    (problem,) = caught.value.problems
    return str(problem)


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


@pytest.mark.parametrize(
    ("name", "address"),
    [("r.urdf", "http://ros.org/wiki/xacro"), ("r.urdf.xacro", "http://wiki.ros.org/xacro")],
)
def test_xacro_goes_by_its_prefix_not_by_the_address(tmp_path: Path, name: str, address: str) -> None:
    head = f"<robot name='r' xmlns:xacro='{address}'>"
    part = "<xacro:macro name='base'><link name='base'/></xacro:macro>"
    (tmp_path / "part.xacro").write_text(f"{head}{part}</robot>")
    file = tmp_path / name
    file.write_text(f"{head}<xacro:include filename='part.xacro'/><xacro:base/></robot>")
    assert [*load(file).links] == ["base"]


def test_what_xacro_offers_still_works(tmp_path: Path) -> None:
    (tmp_path / "sizes.yaml").write_text("wheel: {radius: 0.1, names: [l, r]}\ntilt: !degrees 180")
    body = """
      <xacro:property name="_cfg" value="${xacro.load_yaml('sizes.yaml')}"/>
      <xacro:property name="sides" value="${[s.upper() for s in _cfg.wheel.names]}"/>
      <xacro:macro name="chain" params="n *block side:=${'-'.join(sides)}">
        <xacro:if value="${n > 0}"><xacro:chain n="${n - 1}"><a/></xacro:chain></xacro:if>
        <xacro:unless value="${n > 0}"><xacro:insert_block name="block"/></xacro:unless>
        <sensor n="${n}" s="${side}"/>
      </xacro:macro>
      <xacro:chain n="150"><a/></xacro:chain>
      <value r="${_cfg['wheel'].radius * 2 ** -1}" t="${round(_cfg.tilt - math.pi, 9)} ${'%.3f' % pi}"
        m="${python.max(map(lambda v: v * 2, range(4)))}" e="$(eval 1 + 2)" k="${sorted(_cfg.wheel.keys())}"/>
      <folder here="$(dirname)"/>
      <xacro:include filename="*.part"/>"""
    write(tmp_path, "<link name='included'/>", "one.part")
    text = expand(write(tmp_path, body)).urdf
    assert '<value e="3" k="[\'names\', \'radius\']" m="6" r="0.05" t="0.0 3.142"/>' in text
    assert f'<folder here="{tmp_path}"/>' in text
    assert text.count('s="L-R"/>') == 151
    assert '<link name="included"/>' in text


def test_a_fault_after_expansion_names_its_file_and_line(tmp_path: Path) -> None:
    write(
        tmp_path,
        "\n<xacro:macro name='wheel' params='name mass'>\n<link name='${name}'>\n<inertial>\n"
        "<mass value='${mass}'/><inertia ixx='1' iyy='1' izz='1'/></inertial></link>\n</xacro:macro>",
        "wheel.xacro",
    )
    file = write(
        tmp_path,
        "\n<xacro:include filename='wheel.xacro'/>\n<link name='a'/>\n<xacro:wheel name='w' mass='-1'/>\n"
        "<joint name='j'\n  type='fixd'><parent link='a'/>\n<child link='x'/></joint>",
    )
    with pytest.raises(ModelError) as caught:
        load(file)
    found = [(problem.file, problem.line, problem.code) for problem in caught.value.problems]
    assert (tmp_path / "wheel.xacro", 5, "bad-mass") in found
    assert (file, 5, "joint-type") in found
    assert (file, 5, "unknown-link") in found


def test_checks_name_files_and_lines_after_expansion(tmp_path: Path) -> None:
    write(tmp_path, "\n<link name='a'>\n<frobnicate/></link>", "part.xacro")
    file = write(tmp_path, "<!-- ä -->\n\n<xacro:include filename='part.xacro'/>\n<wobble/>")
    found = {(diagnostic.file, diagnostic.line) for diagnostic in check(load(file))}
    assert {(tmp_path / "part.xacro", 3), (file, 4)} <= found


def test_lines_leave_no_trace_in_the_text(tmp_path: Path) -> None:
    body = "\n<xacro:macro name='m' params='n'><link name='${n}'/></xacro:macro>\n<xacro:m n='a'/>"
    expansion = expand(write(tmp_path, body))
    assert expansion.urdf == '<?xml version="1.0"?><robot name="r"><link name="a"/></robot>'
    assert [line for _, line in expansion.lines.places] == [1, 2]


def test_paths_are_written_as_the_user_wrote_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "d", "<link name='a'/><link name='a'/>", "part.xacro")
    write(tmp_path / "d", "<xacro:include filename='part.xacro'/>")
    monkeypatch.chdir(tmp_path)
    assert fault(Path("d/r.urdf.xacro")).startswith("d/part.xacro:1: link 'a' is defined twice")


XACRO_FAULTS = {
    "undefined name": ("\n<link name='${nowhere}'/>", ":2: xacro: name 'nowhere' is not defined"),
    "in the text of an element": ("\n<link>\n${nowhere}</link>", ":2: xacro: name 'nowhere'"),
    "in a macro": (
        "\n<xacro:macro name='m'>\n<a b='${1/0}'/></xacro:macro>\n<xacro:m/>",
        ":3: xacro: division by zero when evaluating expression '1/0' (in macro 'm')",
    ),
    "unknown macro": ("\n\n<xacro:m/>", ":3: xacro: unknown macro name: xacro:m"),
    "missing parameter": (
        "<xacro:macro name='m' params='n'/>\n<xacro:m/>",
        ":2: xacro: Undefined parameters [n] (in macro 'm')",
    ),
    "no such file": ("\n<xacro:include filename='part.xacro'/>", ":2: xacro: No such file or directory: "),
    "substitution of launch files": (
        "\n<a b='$(find-pkg-share n)/x'/>",
        "'arg']; $(find-pkg-share …) is of launch files, here write $(find PACKAGE)",
    ),
    "undefined argument": (
        "\n<a b='$(arg n)'/>",
        ":2: xacro: Undefined substitution argument n; give --arg n:=",
    ),
    "no such key": ("\n<a b=\"${dict(a=1)['b']}\"/>", ":2: xacro: no such key 'b'"),
}


@pytest.mark.parametrize("name", XACRO_FAULTS)
def test_faults_of_xacro_have_a_line(tmp_path: Path, name: str) -> None:
    body, message = XACRO_FAULTS[name]
    assert message in fault(write(tmp_path, body))


def test_faults_of_an_included_file_name_it(tmp_path: Path) -> None:
    file = write(tmp_path, "\n<xacro:include filename='part.xacro'/>")
    for content, message in {
        f"{HEAD}\n\n<link name='${{nowhere}}'/></robot>": "part.xacro:3: xacro: name 'nowhere'",
        f"{HEAD}\n<link></robot>": "part.xacro:2: xacro: not well-formed XML: mismatched tag",
        f"<!DOCTYPE robot [<!ENTITY a 'a'>]>{HEAD}&a;</robot>": "part.xacro:1: xacro: the file has a DOCTYPE",
        HEAD + "<a>" * 101 + "</a>" * 101 + "</robot>": "part.xacro:1: xacro: more than 100 elements inside",
    }.items():
        (tmp_path / "part.xacro").write_text(content)
        assert message in fault(file)


def test_environment_is_read_only_where_allowed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MY_ROBOT", "seven")
    file = write(tmp_path, "<link name='$(env MY_ROBOT)'/>")
    assert "$(env MY_ROBOT): not set, or not allowed; give --allow-env MY_ROBOT" in fault(file)
    assert load(file, ReadOptions(allow_env=("MY_ROBOT",))).root == "seven"
    optional = write(tmp_path, "<link name='$(optenv MY_ROBOT six)'/>")
    assert load(optional).root == "six"
    assert load(optional, ReadOptions(allow_env=("MY_ROBOT",))).root == "seven"


def test_other_folders_are_read_only_where_allowed(tmp_path: Path) -> None:
    write(tmp_path / "parts", "<link name='a'/>", "part.xacro")
    file = write(tmp_path / "robot", "<xacro:include filename='../parts/part.xacro'/>")
    with pytest.raises(ModelError, match=f"give --allow-path {tmp_path / 'parts'}") as caught:
        load(file)
    assert caught.value.problems[0].code == "outside-path"
    assert load(file, ReadOptions(allow_paths=(tmp_path / "parts",))).root == "a"


def test_a_link_to_a_robot_file_is_read_where_it_is(tmp_path: Path) -> None:
    write(tmp_path / "source", "<link name='a'/>", "part.xacro")
    file = write(tmp_path / "source", "<xacro:include filename='part.xacro'/>")
    installed = tmp_path / "installed"
    installed.mkdir()
    for target in (file, file.with_name("part.xacro")):
        (installed / target.name).symlink_to(target)
    assert load(installed / file.name).root == "a"


WALK = (
    "().__class__.__base__.__subclasses__()[0]",
    "[c for c in ().__class__.__base__.__subclasses__()][0]",
    "(lambda: ().__class__.__base__)()",
)
MACROS = "".join(
    f"<xacro:macro name='m{i}'>{f'<xacro:m{i - 1}/>' * 10 if i else '<a/>'}</xacro:macro>" for i in range(9)
)
GROWING = "<xacro:property name='p0' value='aaaaaaaaaa'/>" + "".join(
    f"<xacro:property name='p{i + 1}' value='{f'${{p{i}}}' * 10}'/>" for i in range(9)
)
ATTACKS = {
    **{f"walks to all classes, {way}": (f"${{{walk}}}", "__") for way, walk in enumerate(WALK)},
    "frames of a generator": ("${(x for x in [1]).gi_frame.f_back.f_globals}", "'.gi_frame' of a generator"),
    "frames by map": ("${list(map(lambda g: g.gi_code.co_consts, [(x for x in [])]))}", "'.gi_code'"),
    "globals of a function": ("${xacro.load_yaml.func_globals}", "'.func_globals' of a function"),
    "tables of xacro": ("${xacro.root}", "name 'root' is not defined"),
    "the module of a function": ("${len.__self__}", "'__self__'"),
    "a format string": ("${'{0.real}'.format(1)}", "xacro"),
    "a format string from an argument": (
        "<xacro:arg name='f' default=\"'{0.real}'.format(1)\"/>${$(arg f)}",
        "'.format' of a str is not for model files",
    ),
    "a template as a method": ("${map(str.format, [1])}", "'.format' of a type"),
    "a name in a string": ("${python.type(1) == '__subclasses__'}", "names of Python's inside"),
    "builtins by name": ("${__builtins__}", "'__builtins__'"),
    "builtins by key": ("${python['__built' + 'ins__']}", "no such key"),
    "what an object holds": ("${python.vars(1)}", "name 'vars' is not defined"),
    "the type of a function": ("${python.type(len)}", "type() of a builtin_function_or_method"),
    "imports": ("${__import__('os').system('id')}", "'__import__'"),
    "assigns": ("${(x := 1)}", "':=' is not for expressions"),
    "eval with builtins": (
        "<xacro:property name='p' value=\"open('/etc/hostname').read()\"/>$(eval ${p})",
        "name 'open' is not defined",
    ),
    "eval with attributes": ("<xacro:property name='p' value='().__class__'/>$(eval ${p})", "'__class__'"),
    "power": ("${10**10**10}", "bits; at most 4096"),
    "powers multiplied": ("${2**4000 * 2**4000}", "8001 bits"),
    "shift": ("${1 &lt;&lt; 10**10}", "bits; at most 4096"),
    "factorial": ("${math.factorial(10**7)}", "10000000 for a factorial"),
    "string": ("${'a' * 10**10}", "10000000000 characters or items"),
    "list": ("${[0] * 10**10}", "10000000000 characters or items"),
    "range": ("${list(range(10**10))}", "10000000000 items"),
    "wide format": ("${'%0999999999d' % 1}", "a format this wide"),
    "padding": ("${'a'.zfill(10**8)}", "a value of 100000000 characters"),
    "loops": ("${[0 for a in range(10**6) for b in range(10**6)]}", "1000000 calls and turns of loops"),
    "loops by map": (
        "${list(map(lambda a: list(map(lambda b: 0, range(10**6))), range(10**6)))}",
        "1000000 calls and turns of loops",
    ),
    "sums": ("${list(map(lambda a: python.sum(range(10**6)), range(10**6)))}", "1000000 calls and turns"),
    "recursion": ("${(lambda f: f(f))(lambda f: f(f))}", "recursion"),
    "output": ("${[xacro.message('a' * 10**6) for i in range(10**6)]}", "1000000 calls and turns of loops"),
    "parentheses": ("${" + "(" * 4000 + "1" + ")" * 4000 + "}", "nested"),
    "signs": ("${" + "-" * 9000 + "1}", "nested too deeply"),
    "a long expression": ("${" + "1+" * 9000 + "1}", "18001 characters"),
    "macro in itself": (
        "<xacro:macro name='m'><xacro:m/></xacro:macro><xacro:m/>",
        "macro 'm' is called 300",
    ),
    "macros in turns": (
        "<xacro:macro name='m'><a><xacro:n/></a></xacro:macro>"
        "<xacro:macro name='n'><xacro:if value='1'><xacro:m/></xacro:if></xacro:macro><xacro:m/>",
        "times inside of itself, without end",
    ),
    "a billion laughs by macros": (f"{MACROS}<xacro:m8/>", "more than 20000 macros"),
    "a billion laughs by properties": (f"{GROWING}${{p9}}", "1000000"),
    "a billion laughs by YAML": ("${str(xacro.load_yaml('laughs.yaml'))}", "inside of each other"),
    "properties in a circle": (
        "<xacro:property name='a' value='${b}'/><xacro:property name='b' value='${a}'/>${a}",
        "circular variable definition: a -> b -> a",
    ),
    "include in itself": ("<xacro:include filename='self.xacro'/>", "include each other without end"),
    "include elsewhere": ("<xacro:include filename='/etc/hostname'/>", "give --allow-path /etc"),
    "include above": ("<xacro:include filename='../../../../../../etc/hostname'/>", "opens"),
    "include by pattern": ("<xacro:include filename='/etc/hostnam*'/>", "give --allow-path /etc"),
    "include above a package": ("<xacro:include filename='$(find twin_robots)/../loader.py'/>", "opens"),
    "YAML of a program": (f"${{xacro.load_yaml('{os.__file__}')}}", "opens"),
    "include of a symbolic link": ("<xacro:include filename='link.xacro'/>", "give --allow-path /etc"),
    "include of a device": ("<xacro:include filename='/dev/zero'/>", "opens '/dev/zero'"),
    "include of the interpreter's files": (f"<xacro:include filename='{os.__file__}'/>", "opens"),
    "YAML elsewhere": ("${xacro.load_yaml('/etc/hostname')}", "give --allow-path /etc"),
    "YAML by a symbolic link": ("${xacro.load_yaml('link.xacro')}", "give --allow-path /etc"),
    "YAML with Python objects": ("${xacro.load_yaml('object.yaml')}", "could not determine a constructor"),
    "environment": ("$(env HOME)", "give --allow-env HOME"),
    "environment by eval": (
        "<xacro:property name='p' value=\"env('HOME')\"/>$(eval ${p})",
        "--allow-env HOME",
    ),
    "a package above": ("$(find ..)", "$(find ..): package not found"),
    "a package by its path": ("$(find /etc)", "$(find /etc): package not found"),
    "markup as a name": ("<xacro:element xacro:name='a>&lt;b/'/>", "not well-formed"),
}


@pytest.mark.timeout(15)
@pytest.mark.parametrize("name", ATTACKS)
def test_attacks_end_in_one_clear_error(tmp_path: Path, name: str) -> None:
    body, message = ATTACKS[name]
    write(tmp_path, "<xacro:include filename='self.xacro'/>", "self.xacro")
    (tmp_path / "link.xacro").symlink_to("/etc/hostname")
    (tmp_path / "object.yaml").write_text("a: !!python/object/apply:os.system ['id']")
    laughs = [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}' if i else 'ha'] * 9)}]" for i in range(12)]
    (tmp_path / "laughs.yaml").write_text("\n".join(laughs))
    before = sorted(tmp_path.iterdir())
    found = fault(write(tmp_path, f"<link name='a'>{body}</link>"))
    assert message in found
    assert len(found) < 1000
    assert sorted(tmp_path.iterdir()) == sorted([*before, tmp_path / "r.urdf.xacro"])


def test_params_of_a_macro_take_no_exponential_time(tmp_path: Path) -> None:
    for params in ("a:=" + "x" * 60 + "'", "a:=" + "''" * 40 + '"'):
        text = f"<xacro:macro name='m' params=\"{params.replace(chr(34), '&quot;')}\"/><link name='a'/>"
        assert load(write(tmp_path, text)).root == "a"


def test_time_is_limited(tmp_path: Path) -> None:
    slow = write(tmp_path, "<link name=\"${xacro.tokenize('a' * 60, 'b]|(a|a)+[c')}\"/>")
    with pytest.raises(ModelError, match=r"xacro did not finish within 0\.5 s"):
        expand(slow, time_limit_s=0.5)
