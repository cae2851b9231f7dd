"""Nothing that files or other nodes write steers the terminal, and all that is text stays text."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path

import pytest
import typer

from twin.cli import app
from twin.cli.console import guard_terminal, print_error, stdout
from twin.errors import ModelError, TwinError
from twin.models import load
from twin.plain_text import escaped

UNSEEN = [*"\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069\u200e\u200f\u061c", "\x9b", "\x85", "\x07"]


class Terminal(io.StringIO):
    """A terminal that keeps what is written."""

    def isatty(self) -> bool:
        """Return True."""
        return True


@pytest.mark.parametrize("char", UNSEEN)
def test_what_is_not_seen_is_escaped_as_in_json(char: str) -> None:
    assert json.loads(f'"{escaped(f"a{char}b")}"') == f"a{char}b"
    assert char not in escaped(f"a{char}b") + escaped(char, keeps_styles=True)


@pytest.mark.parametrize("text", ["中文", "עברית", "العربية", "é 🤖\n\tb", "👩\u200d🔧"])
def test_text_stays(text: str) -> None:
    assert escaped(text) == text


@pytest.mark.parametrize("stream", [io.StringIO, Terminal])
def test_what_is_printed_has_no_controls_but_colours(
    stream: type[io.StringIO], monkeypatch: pytest.MonkeyPatch
) -> None:
    out, err = stream(), stream()
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", err)
    guard_terminal()
    hostile = f"x{''.join(UNSEEN)}\x1b[2Jy"
    print_error(TwinError(hostile))
    assert "\x1b[2J" not in err.getvalue()
    print("a\u202eb\x1b[2J\x1b]0;title\x1bc")  # noqa: T201
    stdout().print("c\u202ed", style="bold red")
    for text in (out.getvalue(), err.getvalue()):
        assert not set(UNSEEN) & set(text)
        assert not any(steers in text for steers in ("\x1b[2J", "\x1b]", "\x1bc"))
    assert "a\\u202eb" in out.getvalue()
    assert "c\\u202ed" in out.getvalue()
    assert ("\x1b" in out.getvalue()) == (stream is Terminal)


@pytest.mark.parametrize(("encoding", "shown"), [("ascii", "?"), ("utf-8", "ü")])
def test_typer_does_not_write_past_the_guard(
    monkeypatch: pytest.MonkeyPatch, encoding: str, shown: str
) -> None:
    """What typer takes for a misconfigured stream, it writes UTF-8 below."""
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding=encoding))
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    guard_terminal()
    typer.echo("a\u202eü")
    sys.stdout.flush()
    assert raw.getvalue() == f"a\\u202e{shown}\n".encode(encoding)


def test_every_command_prints_through_the_guard(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "s.yaml").write_text("na\u202eme: 1\n", encoding="utf-8")
    err = io.StringIO()
    monkeypatch.setattr(sys, "stderr", err)
    monkeypatch.setattr(sys, "stdout", io.StringIO())
    monkeypatch.setattr(sys, "argv", ["twin", "run", str(tmp_path / "s.yaml")])
    with pytest.raises(SystemExit):
        app.run_app()
    assert "na\\u202eme" in err.getvalue()
    assert "\u202e" not in err.getvalue()


@pytest.mark.parametrize("char", ["\u202e", "\u2067", "\u200f", "\x9b"])
def test_a_name_with_what_is_not_seen_is_refused(tmp_path: Path, char: str) -> None:
    robot = tmp_path / "r.urdf"
    robot.write_text(f'<robot name="r{char}"><link name="a{char}b"/></robot>', encoding="utf-8")
    with pytest.raises(ModelError, match="characters that are not seen") as caught:
        load(robot)
    assert char not in str(caught.value)
