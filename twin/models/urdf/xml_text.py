"""The text of an XML file as UTF-8, and the limits that it keeps before a parser builds a tree of it."""

from __future__ import annotations

import codecs
import re
from pathlib import Path
from xml.parsers import expat

from twin.errors import ModelError, Problem
from twin.files.reading import read_bytes

MAX_BYTES = 32 * 1024 * 1024
MAX_ELEMENTS = 200_000
MAX_DEPTH = 100
"""Elements inside of each other; robots have about ten."""
MAX_ATTRIBUTES = 100
"""Of one element."""
MAX_CHARACTERS = 1_000_000
"""Of one attribute's value."""
SHOWN = 40
"""Characters of a name in a message."""

_BOMS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
_DECLARED = re.compile(r"""^(<\?xml\b[^>]*?)\s+encoding\s*=\s*["']([^"'>]*)["']""")
_ENCODINGS = re.compile(
    r"utf-?8|us-ascii|ascii|(iso-?)?8859-\d+|iso-8859-\d+|latin-?\d|windows-125\d|cp125\d"
    r"|gb2312|gbk|gb18030|big5|shift_jis|euc-(jp|kr)|koi8-[ru]"
)
"""What a declaration may name; Python knows codecs that are none of text."""


def read_utf8(source: Path) -> bytes:
    """Return a file's text as UTF-8, without byte order mark; UTF-8 stays as it is, byte by byte.

    Raises:
        ModelError: The file cannot be read, is too large, or is not text in the encoding that it declares.
    """
    try:
        if source.stat().st_size > MAX_BYTES:
            raise _too_large(source.stat().st_size, source)
        raw = read_bytes(source, MAX_BYTES)
    except OSError as error:
        raise _fault(f"cannot be read: {error.strerror}; give a file", source, code="no-file") from None
    return as_utf8(raw, source)


def as_utf8(raw: bytes, source: Path) -> bytes:
    """Return the text of `source` as UTF-8; see `read_utf8`.

    Raises:
        ModelError: It is not text in the encoding that it declares.
    """
    encoding, body = _encoding(raw, source)
    if encoding == "utf-8" and body.isascii() and b"\0" not in body:
        return body
    try:
        text = body.decode(encoding)
    except UnicodeDecodeError as error:
        line = body.count(b"\n", 0, error.start) + 1
        message = f"byte 0x{body[error.start]:02x} is no {encoding.upper()}; save the file as UTF-8"
        raise _fault(message, source, line) from None
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise _fault("the file has a null byte; save it as plain text", source, line)
    if encoding == "utf-8":
        return body
    return _DECLARED.sub(r'\1 encoding="UTF-8"', text, count=1).encode()


def scan(text: bytes, source: Path, *, has_lines: bool = True) -> list[int]:
    """Return the line of every start tag of a UTF-8 text, in order.

    Args:
        text: The text.
        source: The file it came from, for messages.
        has_lines: False if the lines of `text` are not those of `source`; messages then have none.

    Raises:
        ModelError: Not well-formed, too large, too deep, or with a DOCTYPE: its entities can read files and
            exhaust memory, and no robot needs them.
    """
    if len(text) > MAX_BYTES:
        raise _too_large(len(text), source)
    if not text.strip():
        raise _fault("the file is empty; a URDF file has <robot name='...'>", source)
    return _Scanner(source, has_lines).scan(text)


class _Scanner:
    # expat, not lxml: libxml2 expands internal entities inside attributes even with resolve_entities=False.

    def __init__(self, source: Path, has_lines: bool) -> None:
        self._source = source
        self._has_lines = has_lines
        self._lines: list[int] = []
        self._open: list[tuple[str, int]] = []
        self._parser = expat.ParserCreate("utf-8")
        self._parser.StartDoctypeDeclHandler = self._refuse_doctype
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end

    def scan(self, text: bytes) -> list[int]:
        try:
            self._parser.Parse(text, True)
        except expat.ExpatError as error:
            reason = expat.ErrorString(error.code).removeprefix("not well-formed (").removesuffix(")")
            if self._open and reason in ("mismatched tag", "no element found", "unclosed token"):
                tag, line = self._open[-1]
                reason += f"; <{tag[:SHOWN]}>{f' of line {line}' if self._has_lines else ''} is not closed"
            elif error.code == expat.errors.codes[expat.errors.XML_ERROR_MISPLACED_XML_PI]:
                reason += "; <?xml …?> must be the very first thing in the file: remove what stands before it"
            raise self._fault(f"not well-formed XML: {reason}", error.lineno) from None
        return self._lines

    def _refuse_doctype(self, *_: object) -> None:
        raise self._fault("the file has a DOCTYPE; remove it, a robot needs none", code="doctype")

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self._lines.append(self._parser.CurrentLineNumber)
        self._open.append((tag, self._parser.CurrentLineNumber))
        longest = max(map(len, (tag, *attributes.values())))
        for number, most, what in (
            (len(self._lines), MAX_ELEMENTS, "elements"),
            (len(self._open), MAX_DEPTH, "elements inside of each other, down to {}"),
            (len(attributes), MAX_ATTRIBUTES, "attributes in {}"),
            (longest, MAX_CHARACTERS, "characters in a value of {}"),
        ):
            if number > most:
                message = f"the file has more than {most} {what}".format(f"<{tag[:SHOWN]}>")
                raise self._fault(message, code="too-large")

    def _end(self, _: str) -> None:
        self._open.pop()

    def _fault(self, message: str, line: int | None = None, *, code: str = "bad-xml") -> ModelError:
        place = line or self._parser.CurrentLineNumber
        return _fault(message, self._source, place if self._has_lines else None, code=code)


def _encoding(raw: bytes, source: Path) -> tuple[str, bytes]:
    """Return a text's encoding, as Python calls it, and the text without byte order mark."""
    for mark, encoding in _BOMS:
        if raw.startswith(mark):
            return encoding, raw[len(mark) :]
    for start, encoding in ((b"<\0", "utf-16-le"), (b"\0<", "utf-16-be")):
        if raw.startswith(start):
            return encoding, raw
    declared = _DECLARED.match(raw[:200].decode("latin-1"))
    name = declared[2].lower() if declared else "utf-8"
    if not _ENCODINGS.fullmatch(name):
        raise _fault(f"encoding '{name}' is unknown; save the file as UTF-8", source, 1)
    # US-ASCII files with a stray character are UTF-8 in practice.
    return ("utf-8" if name in ("utf8", "us-ascii", "ascii") else name), raw


def _too_large(size: int, source: Path) -> ModelError:
    return _fault(f"the file has {size} bytes; at most {MAX_BYTES} are read", source, code="too-large")


def _fault(message: str, source: Path, line: int | None = None, *, code: str = "bad-xml") -> ModelError:
    return ModelError(Problem(message, source, line, code=code))
