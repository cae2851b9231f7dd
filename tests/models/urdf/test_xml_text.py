"""The text of a robot file: encodings, limits, and one clear error for what is no such text."""

from __future__ import annotations

import codecs
from pathlib import Path

import pytest

from twin.errors import ModelError
from twin.models import load

ROBOT = b"<robot name='r'><link name='a'/></robot>"


def declared(encoding: str) -> str:
    return f"<?xml version='1.0' encoding='{encoding}'?>\n<robot name='rä'><link name='ä'/></robot>"


READ = {
    "byte order mark": (codecs.BOM_UTF8 + ROBOT, "a"),
    "byte order mark and declaration": (codecs.BOM_UTF8 + declared("utf-8").encode(), "ä"),
    "UTF-16": (declared("UTF-16").encode("utf-16"), "ä"),
    "UTF-16, big-endian": (codecs.BOM_UTF16_BE + declared("utf-16").encode("utf-16-be"), "ä"),
    "UTF-16 without mark": (declared("utf-16").encode("utf-16-le"), "ä"),
    "latin-1": (declared("ISO-8859-1").encode("latin-1"), "ä"),
    "windows": (declared("windows-1252").encode("cp1252"), "ä"),
    "default namespace": (b"<robot xmlns='http://x.y' name='r'><link name='a'/></robot>", "a"),
    "other namespaces": (b"<robot xmlns:s='http://x.y' name='r'><link name='a'/><s:sensor/></robot>", "a"),
    "instructions": (b"<?a b?><robot name='r'><?php echo 1 ?><link name='a'/></robot>", "a"),
    "character data": (b"<robot name='r'><link name='a'><![CDATA[<b/>]]></link></robot>", "a"),
}


@pytest.mark.parametrize("name", READ)
def test_text_is_read_and_published_as_utf8(tmp_path: Path, name: str) -> None:
    text, link = READ[name]
    (tmp_path / "r.urdf").write_bytes(text)
    description = load(tmp_path / "r.urdf")
    assert description.root == link
    assert f"<link name='{link}'" in description.urdf
    assert "\ufeff" not in description.urdf


def test_utf8_is_published_byte_by_byte(tmp_path: Path) -> None:
    text = "<?xml  version='1.0' encoding='utf-8' ?>\r\n<robot name='ü'>\r\n<link name='a'/></robot>\r\n"
    (tmp_path / "r.urdf").write_bytes(text.encode())
    assert load(tmp_path / "r.urdf").urdf == text


def test_xacro_in_another_encoding(tmp_path: Path) -> None:
    text = declared("UTF-16").replace("<link", "<link a='${1 + 1}'")
    text = text.replace("<robot", "<robot xmlns:xacro='http://www.ros.org/wiki/xacro'")
    (tmp_path / "r.urdf").write_bytes(text.encode("utf-16"))
    assert '<link a="2" name="ä"/>' in load(tmp_path / "r.urdf").urdf


BOMB = b"<!DOCTYPE r [<!ENTITY e0 'ha'>%s]>\n<robot name='&e9;'/>" % b"".join(
    b"<!ENTITY e%d '%s'>" % (i, b"&e%d;" % (i - 1) * 10) for i in range(1, 10)
)
REFUSED = {
    "empty": (b"", "bad-xml", ": the file is empty"),
    "blank": (b" \n\n", "bad-xml", ": the file is empty"),
    "a picture": (b"\x89PNG\r\n\x1a\n", "bad-xml", ":1: byte 0x89 is no UTF-8"),
    "JSON": (b'{"name": 1}', "bad-xml", ":1: not well-formed XML: invalid token"),
    "latin-1, not declared": (
        "<robot>\n<a b='ä'/>".encode("latin-1"),
        "bad-xml",
        ":2: byte 0xe4 is no UTF-8",
    ),
    "latin-1, declared as UTF-8": (declared("utf-8").encode("latin-1"), "bad-xml", ":2: byte 0xe4"),
    "half a character": (b"\xff\xfe<\0r", "bad-xml", ":1: byte 0x72 is no UTF-16-LE"),
    "no encoding of text": (declared("rot13").encode(), "bad-xml", ":1: encoding 'rot13' is unknown"),
    "encoding of Python": (declared("unicode_escape").encode(), "bad-xml", "'unicode_escape' is unknown"),
    "null byte": (b"<robot name='r'>\n\0</robot>", "bad-xml", ":2: the file has a null byte"),
    "control character": (b"<robot name='r'>\n\x01</robot>", "bad-xml", ":2: not well-formed XML: invalid"),
    "null reference": (b"<robot>\n<a b='&#0;'/></robot>", "bad-xml", ":2: not well-formed XML: reference to"),
    "unclosed": (
        b"<robot>\n<link>\n\n",
        "bad-xml",
        ":4: not well-formed XML: no element found; <link> of line 2",
    ),
    "mismatched": (
        b"<robot>\n<link>\n</lonk>",
        "bad-xml",
        ":3: not well-formed XML: mismatched tag; <link> of",
    ),
    "comment before the declaration": (
        b"<!-- exported -->\n" + declared("utf-8").encode(),
        "bad-xml",
        ":2: not well-formed XML: XML or text declaration not at start of entity; <?xml",
    ),
    "twice": (ROBOT + b"\n" + ROBOT, "bad-xml", ":2: not well-formed XML: junk after document element"),
    "attribute twice": (b"<robot>\n<a b='' b=''/></robot>", "bad-xml", ":2: not well-formed XML: duplicate"),
    "unknown entity": (
        b"<robot>\n<a b='&c;'/></robot>",
        "bad-xml",
        ":2: not well-formed XML: undefined entity",
    ),
    "no namespace": (
        b"<robot>\n<a:b/></robot>",
        "bad-xml",
        ":2: not well-formed XML: Namespace prefix a on b",
    ),
    "foreign root": (b"<r:robot xmlns:r='a'/>", "not-urdf", ":1: the root element is <{a}robot>"),
    "deep": (
        b"<robot>" + b"<a>" * 100_000 + b"</a>" * 100_000 + b"</robot>",
        "too-large",
        ":1: the file has more than 100 elements inside of each other, down to <a>",
    ),
    "wide": (b"<robot>" + b"<a/>" * 300_000 + b"</robot>", "too-large", "more than 200000 elements"),
    "attributes": (
        b"<robot>\n<a " + b" ".join(b"a%d=''" % i for i in range(10_000)) + b"/></robot>",
        "too-large",
        ":2: the file has more than 100 attributes in <a>",
    ),
    "a long attribute": (
        b"<robot name='" + b"a" * 11_000_000 + b"'/>",
        "too-large",
        ":1: the file has more than 1000000 characters in a value of <robot>",
    ),
    "a large file": (b" " * (32 * 1024 * 1024 + 1), "too-large", "the file has 33554433 bytes"),
    "DOCTYPE": (
        b"<!DOCTYPE robot SYSTEM 'file:///etc/hostname'>" + ROBOT,
        "doctype",
        ":1: the file has a DOCTYPE",
    ),
    "external entity": (
        b"<?xml version='1.0'?>\n<!DOCTYPE r [<!ENTITY a SYSTEM '/etc/hostname'>]>\n<robot name='&a;'/>",
        "doctype",
        ":2: the file has a DOCTYPE",
    ),
    "a billion laughs": (BOMB, "doctype", ":1: the file has a DOCTYPE"),
    "DOCTYPE in UTF-16": ("<!DOCTYPE r><robot/>".encode("utf-16"), "doctype", ":1: the file has a DOCTYPE"),
}


@pytest.mark.timeout(5)
@pytest.mark.parametrize("suffix", ["urdf", "xacro"])
@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_robot_text_gets_one_error(tmp_path: Path, name: str, suffix: str) -> None:
    text, code, message = REFUSED[name]
    (tmp_path / f"r.{suffix}").write_bytes(text)
    with pytest.raises(ModelError) as caught:
        load(tmp_path / f"r.{suffix}")
    (problem,) = caught.value.problems
    assert problem.code == code
    assert message in str(problem)
    assert "\n" not in str(problem)


def test_lines_are_those_of_the_start_of_a_tag(tmp_path: Path) -> None:
    filler = "\n" * 70_000
    (tmp_path / "r.urdf").write_text(f"<robot name='r'>{filler}<link\n\nname='a'/>\n</robot>")
    assert load(tmp_path / "r.urdf").links["a"].line == 70_001


def test_nothing_else_is_fetched(tmp_path: Path) -> None:
    include = "<xi:include href='/etc/hostname' parse='text'/>"
    text = (
        f"<robot name='r' xmlns:xi='http://www.w3.org/2001/XInclude'><link name='a'>{include}</link></robot>"
    )
    (tmp_path / "r.urdf").write_text(text)
    assert load(tmp_path / "r.urdf").urdf == text


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    file = tmp_path / "r.urdf"
    with pytest.raises(ModelError, match="no such model file"):
        load(file)
    file.symlink_to(file)
    with pytest.raises(ModelError, match="no such model file"):
        load(file)
    with pytest.raises(ModelError, match="it is a folder"):
        load(tmp_path)
