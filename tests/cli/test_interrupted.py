"""Ctrl-C at a moment that makes something else of it."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

_SCRIPT = """
import signal
from twin import cli
from twin.cli import app


class Descriptor:
    def __set_name__(self, owner, name):
        signal.raise_signal(signal.SIGINT)


def interrupted():
    class Owner:
        field = Descriptor()


app.app = interrupted
cli.main()
"""


def test_an_interrupt_that_python_wraps_is_one_all_the_same() -> None:
    """Until Python 3.12 what __set_name__ raises becomes the cause of a RuntimeError."""
    done = subprocess.run([sys.executable, "-c", _SCRIPT], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_an_interrupt_that_python_cannot_raise_is_silent() -> None:
    """In a destructor Python would print the KeyboardInterrupt, and go on."""
    script = _SCRIPT.replace("__set_name__(self, owner, name)", "__del__(self)")
    script = script.replace(
        "    class Owner:\n        field = Descriptor()", "    Descriptor()\n    raise RuntimeError"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_an_interrupt_while_the_interpreter_ends_is_silent() -> None:
    script = (
        "import atexit, signal, sys\n"
        "from twin.cli import main\n"
        "atexit.register(lambda: signal.raise_signal(signal.SIGINT))\n"
        "sys.argv = ['twin', 'map', '--help']\n"
        "main()\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "")


_FORKED = """
import os, select, signal, sys, tempfile

parent, step, found = os.getpid(), int(sys.argv[1]), []
del sys.argv[1]


class Interrupts:
    def find_spec(self, name, path=None, target=None):
        if os.getpid() != parent:
            return None
        found.append(name)
        if name in ("twin", "twin.cli") or len(found) % step:
            return None
        said = tempfile.TemporaryFile()
        child = os.fork()
        if child == 0:
            os.dup2(said.fileno(), 1)
            os.dup2(said.fileno(), 2)
            os.kill(os.getpid(), signal.SIGINT)
            return None
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        said.seek(0)
        words = said.read().decode()
        if (code, words) != (130, ""):
            os.write(2, f"{len(found)} {name}: {code} {words[-500:]}\\n".encode())
        return None


sys.meta_path.insert(0, Interrupts())
from twin.cli import main

if os.getpid() == parent:
    os.write(2, f"before main: {' '.join(found)}\\n".encode())
try:
    main()
finally:
    if os.getpid() == parent:
        os.write(2, f"{len(found)} imports\\n".encode())
"""


@pytest.mark.parametrize(("command", "step", "imports"), [("--help", 30, 100), ("schema", 150, 400)])
def test_an_interrupt_at_any_import_ends_with_130_and_no_word(command: str, step: int, imports: int) -> None:
    """The process forks where it imports, and the child gets the signal: every moment for the price of one.

    What comes before is the interpreter's own start, and two files without an import of their own.
    """
    done = subprocess.run(
        [sys.executable, "-c", _FORKED, str(step), command], capture_output=True, text=True, check=False
    )
    first, *faults, last = done.stderr.splitlines()
    assert (first, faults) == ("before main: twin twin.cli", [])
    assert int(last.split()[0]) > imports
    assert done.returncode == 0


_SIGNALLED = """
import os, signal, sys, types
import twin
from twin.cli import app, main
from twin.cli.run import once
from twin.scenario import schema
from twin.scenario.verdict import Verdict

cases, words = [case.split(":") for case in sys.argv[1].split()], sys.argv[2:]


class Run:
    def __init__(self, scenario, **options):
        self.name = scenario.name

    def advance_to_end(self, progress, watch=None):
        signal.raise_signal(number)

    def finish(self):
        return Verdict(scenario=self.name, seed=0)

    def close(self):
        pass


twin.runtime = sys.modules["twin.runtime"] = types.SimpleNamespace(OpenRun=Run, Progress=None)
for number, how, out in cases:
    number = int(number)
    child = os.fork()
    if child == 0:
        if how == "ignored":
            signal.signal(number, signal.SIG_IGN)
        sys.argv = ["twin", *words, "--out", out]
        main()
    sys.stderr.write(f"{os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])}\\n")
"""


def test_a_run_that_is_ended_from_outside_says_so_in_its_verdict(tmp_path: Path) -> None:
    """A terminal that closes, a CI system, and a terminal that closes over nohup: forks of one process."""
    scenario = tmp_path / "a.yaml"
    scenario.write_text(
        "name: a\nduration: 1\nrobots: [{model: r2d2}]\nchecks: [{energy: {max: 1}}]\n", "utf-8"
    )
    kinds = [(signal.SIGHUP, "handled"), (signal.SIGTERM, "handled"), (signal.SIGHUP, "ignored")]
    cases = " ".join(f"{number:d}:{how}:{tmp_path / str(at)}" for at, (number, how) in enumerate(kinds))
    done = subprocess.run(
        [sys.executable, "-c", _SIGNALLED, cases, "run", str(scenario)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "130\n130\n1\n")
    for at, error in enumerate(("interrupted", "interrupted", None)):
        assert json.loads((tmp_path / str(at) / "verdict.json").read_text("utf-8"))["error"] == error
        assert not (tmp_path / str(at) / ".lock").exists()
