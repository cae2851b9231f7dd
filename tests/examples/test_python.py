"""The programs that use `import twin` do what they say."""

from __future__ import annotations

import runpy
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAMS = Path(__file__).parents[2] / "examples" / "python"


@pytest.mark.parametrize(
    ("program", "lines"),
    [
        ("own_robot", ["rover: 5 links, 4.70 kg", "corner 4: x 0.0"]),
        ("own_mission", ["shelf: there after", "table: there after", "pass, digest"]),
        ("own_check", ["pass: 1.05 of 1.2 m/s²"]),
        ("own_controller", ["succeeded: True"]),
        ("own_sensor", ["°C at x 0.00 m", "°C at x 1."]),
        ("pick_tote", ["seed 1: picked after 1", "seed 2: picked after 1"]),
        ("parameter_study", ["0.2 m/s: ", "0.6 m/s: ", "written to study.png"]),
    ],
)
def test_program(
    program: str,
    lines: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [program, "study.png"])
    runpy.run_path(str(PROGRAMS / f"{program}.py"), run_name="__main__")
    printed = capsys.readouterr().out
    for line in lines:
        assert line in printed, printed
    if program == "parameter_study":
        assert (tmp_path / "study.png").stat().st_size > 5000


def test_every_program_is_run_here() -> None:
    marks = test_program.pytestmark[0].args[1]
    assert sorted(name for name, _ in marks) == sorted(file.stem for file in PROGRAMS.glob("*.py"))


def test_a_missing_matplotlib_is_named() -> None:
    code = (
        "import sys; sys.modules['matplotlib'] = None\n"
        f"import runpy; runpy.run_path({str(PROGRAMS / 'parameter_study.py')!r}, run_name='__main__')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == (
        "the plot needs the package matplotlib, which is not installed: pip install matplotlib\n"
    )
