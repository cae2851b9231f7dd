"""twin view in the terminal: postures, mistakes, recordings."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from twin.cli import app as app_module
from twin.cli.model.view import Layer
from twin.recording.read_back import read
from twin.recording.view.robot_layers import LAYERS

Invoke = Callable[..., tuple[int, str]]


@pytest.fixture
def invoke(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Invoke:
    def call(*arguments: object) -> tuple[int, str]:
        monkeypatch.setattr(sys, "argv", ["twin", "view", *map(str, arguments)])
        with pytest.raises(SystemExit) as exit_info:
            app_module.run_app()
        captured = capsys.readouterr()
        assert isinstance(exit_info.value.code, int)
        return exit_info.value.code, captured.out + captured.err

    return call


def test_a_posture_is_saved(invoke: Invoke, tmp_path: Path) -> None:
    file = tmp_path / "a.rrd"
    assert invoke("r2d2", "--joint", "periscope=0.15", "--save", file) == (0, "")
    recording = read(file)
    children = [row[0] for row in recording.column("/tf", "Transform3D:child_frame").values]
    xyz = recording.column("/tf", "Transform3D:translation").values[children.index("rod")][0]
    assert recording.timelines == {"posture"}
    assert recording.recording_id == "r2d2"
    assert xyz[2] != 0.0
    invoke("r2d2", "--save", file)
    (start,) = read(file).column("/tf", "Transform3D:translation").values[children.index("rod")]
    assert sum((a - b) ** 2 for a, b in zip(xyz, start, strict=True)) ** 0.5 == pytest.approx(0.15)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--joint", "periskope=0.1"], "did you mean 'periscope'? Valid: periscope, swivel, tilt"),
        (["--joint", "periscope=1"], "outside of its limits [0, 0.2] m"),
        (["--joint", "periscope"], "must be NAME=VALUE in rad or m"),
        (["--joint", "=1"], "must be NAME=VALUE"),
        (["--joint", "swivel=90deg"], "must be NAME=VALUE"),
        (["--joint", "swivel=nan"], "not a finite number"),
    ],
)
def test_mistakes(invoke: Invoke, tmp_path: Path, words: list[str], message: str) -> None:
    code, printed = invoke("r2d2", *words, "--save", tmp_path / "a.rrd")
    assert code == 2
    assert message in printed
    assert not (tmp_path / "a.rrd").exists()


def test_a_file_with_errors(invoke: Invoke, tmp_path: Path) -> None:
    (tmp_path / "r.urdf").write_text("<robot name='r'>\n<link name='a'/>\n<link name='a'/></robot>")
    code, printed = invoke(tmp_path / "r.urdf", "--save", tmp_path / "a.rrd")
    assert code == 2
    assert "r.urdf:3: " in printed


def test_layers_of_the_command_are_those_of_the_view() -> None:
    assert [layer.value for layer in Layer] == list(LAYERS)
