"""The verdict of a run, and the files that carry it: `verdict.json` and `junit.xml`."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from twin.errors import RecordingError
from twin.files.writing import write_whole
from twin.scenario.checks import CheckResult
from twin.scenario.faults import FaultReport

VERDICT = "verdict.json"
"""The file of a run's folder that says how it ended; the last that is written."""

Label = Literal["model", "shadow", "twin"]
"""What virtual robots are to physical ones."""

EXIT_CODES = {"pass": 0, "fail": 1, "error": 2, "inconclusive": 3}
"""Of commands; a single run is never inconclusive."""


@dataclass(frozen=True, kw_only=True)
class Images:
    """All that was drawn for cameras: pixel by pixel the same in runs that were looked at alike."""

    digest: str
    """Of the pixels that OpenGL drew; on one machine, with one version of the renderer."""
    drawn: int
    """How many pictures."""
    renderer: str
    """Who drew."""


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """The outcome of one run."""

    scenario: str
    seed: int
    checks: tuple[CheckResult, ...] = ()
    faults: tuple[FaultReport, ...] = ()
    """What became of each fault, in the order of the scenario."""
    metrics: Mapping[str, float] = field(default_factory=dict)
    """`sim_time_s`, `wall_time_s`, `cpu_time_s`, `real_time_factor`, `recoveries`; of some runs more."""
    digest: str | None = None
    """SHA-256 over every published sample and the final physics state; None if the run was not finished."""
    images: Images | None = None
    """What cameras saw; None if nobody looked."""
    deterministic: bool = True
    """False if something outside of the process could change the run."""
    clock: Literal["inproc", "lockstep", "free"] = "inproc"
    """Whose time counted: the run's alone, the run's with others that it waited for, everybody's own."""
    versions: Mapping[str, str] = field(default_factory=dict)
    plugins: Mapping[str, str] = field(default_factory=dict)
    """What users brought, by name: a package and its version, or the hash of a file."""
    cpu: str = ""
    """The class of CPU within which digests can be compared."""
    label: Label = "model"
    """What the robots are at the end; without physical ones they are a model."""
    test: str = ""
    """Name of the test that the run was, such as `warehouse[seed=3]`; empty if it was none."""
    command: str = ""
    """What makes the same run again, in the folder where it was made; empty if a program did."""
    error: str | None = None
    """Why the run could not be made or finished."""

    @property
    def verdict(self) -> Literal["pass", "fail", "error"]:
        """`pass` if every check holds; `error` if the run could not be made."""
        if self.error is not None:
            return "error"
        return "pass" if self.checks and all(check.passed for check in self.checks) else "fail"

    @property
    def exit_code(self) -> int:
        """0 for pass, 1 for fail, 2 for error."""
        return EXIT_CODES[self.verdict]

    def to_dict(self) -> dict[str, Any]:
        """Return the content of `verdict.json`."""
        first = {"scenario": self.scenario, "seed": self.seed, "verdict": self.verdict, "error": self.error}
        return first | asdict(self) | {"checks": [asdict(check) for check in self.checks]}

    def to_json(self) -> str:
        """Return `verdict.json`; numbers that are not finite become null, as JSON has none."""
        return json.dumps(_finite(self.to_dict()), indent=2, ensure_ascii=False, allow_nan=False) + "\n"

    def write(self, folder: Path) -> None:
        """Write `junit.xml` and `verdict.json`; each file appears whole or not at all.

        Raises:
            RecordingError: One of them cannot be written; then there is no `verdict.json` of this run.
        """
        write_junit(folder / "junit.xml", [self])
        write_whole(folder / VERDICT, self.to_json())


def runs_in(folder: Path) -> list[Path]:
    """Return the folders of runs in a folder, itself included, in the order of their paths.

    Raises:
        RecordingError: There is none.
    """
    found = [file.parent for file in sorted(folder.rglob(VERDICT))]
    if not found:
        raise RecordingError(f"{folder}: no run in this folder; a run's folder holds {VERDICT}")
    return found


def read_verdict(folder: Path) -> dict[str, Any]:
    """Return the content of a run's `verdict.json`.

    Raises:
        RecordingError: It cannot be read, or is none.
    """
    file = folder / VERDICT
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as fault:
        raise RecordingError(f"{file}: cannot be read: {fault}") from fault
    match found:
        case {"scenario": _, "verdict": _, "checks": [*checks], "metrics": {}}:
            if all(isinstance(check, dict) and "name" in check for check in checks):
                return found
    raise RecordingError(f"{file}: is no verdict of a run")


def write_junit(file: Path, verdicts: Sequence[Verdict]) -> None:
    """Write one JUnit file over several runs, for CI."""
    from twin.scenario.junit import junit_xml

    write_whole(file, junit_xml([verdict.to_dict() for verdict in verdicts]))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
