"""Copies of the repository to change and to test in, and what their tests reach."""

from __future__ import annotations

import json
import os
import resource
import shutil
import subprocess
import sys
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from coverage import CoverageData

from tests.mutation.mutants import Mutant, Site

_PARTS = ("twin", "tests", "scenarios", "examples", "docs")
_SUITES = (
    ("tests/navigation", "tests/sim", "tests/warehouse", "tests/manipulation", "tests/test_geometry.py"),
    (
        *("tests/models", "tests/convert", "tests/controllers", "tests/parameters", "tests/scenario"),
        "tests/test_periods.py",
    ),
)
"""The tests of the packages themselves, in two parts that take about as long."""
_FAST = ("-m", "not slow and not bench and not long", "-p", "no:cacheprovider", "-q", "--timeout=0")
_LONGEST_WAIT_S = 3600.0
_MOST_SECONDS = 20.0
"""Of tests for one mutant, by what they took when nothing was changed."""


@dataclass(frozen=True, kw_only=True)
class Reach:
    """What tests reach."""

    lines: dict[str, dict[int, tuple[str, ...]]]
    """File -> line -> the tests that run it; those lines that run at the import have none."""
    seconds: dict[str, float]
    """Of every test that passes."""

    def reaches(self, site: Site) -> bool:
        """Whether the statement is run; of a kernel, whether its module is imported."""
        reached = self.lines.get(site.file, {})
        return bool(reached) and (site.in_kernel or any(line in reached for line in site.lines))

    def tests(self, site: Site) -> list[str]:
        """Return tests that may notice, those of the same folder first, then the fastest first."""
        reached, near = self.lines.get(site.file, {}), self._near(site)
        direct = {test for line in site.lines for test in reached.get(line, ())} & self.seconds.keys()
        if site.in_kernel or not direct:  # compiled, or run at the import: whoever tests the module
            direct |= near
        chosen, total = [], 0.0
        for test in sorted(direct, key=lambda test: (test not in near, self.seconds[test], test)):
            total += self.seconds[test]
            if chosen and total > _MOST_SECONDS:
                break
            chosen.append(test)
        return chosen

    def _near(self, site: Site) -> set[str]:
        prefix = mirror(site.file, self.seconds)
        return {test for test in self.seconds if test.startswith(prefix)}

    def cost(self, tests: list[str]) -> float:
        """How long they took when nothing was changed [s]."""
        return sum(self.seconds.get(test, 1.0) for test in tests)


class Copy:
    """A copy of the repository with a cache of machine code of its own."""

    def __init__(self, root: Path, folder: Path) -> None:
        self.folder, self._cache = folder / "twin", folder / "cache"
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)
        self._cache.mkdir(exist_ok=True)
        for part in _PARTS:
            shutil.copytree(root / part, self.folder / part, ignore=shutil.ignore_patterns("__pycache__"))
        for file in root.glob("*.*"):
            if file.is_file():
                shutil.copy2(file, self.folder)

    def python(self, *words: str, cpu_seconds: float | None = None, **variables: str) -> int:
        """Run Python here; its exit code, negative if it takes more of the processor than that, or waits."""
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(self._cache)}
        with subprocess.Popen(
            (sys.executable, *words),
            cwd=self.folder,
            env=environment | variables,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        ) as process:
            if cpu_seconds is not None:  # a busy machine is no reason
                most = int(cpu_seconds)
                resource.prlimit(process.pid, resource.RLIMIT_CPU, (most, most))
            try:
                return process.wait(_LONGEST_WAIT_S)
            except subprocess.TimeoutExpired:
                process.kill()
                return -1

    def notices(self, mutant: Mutant, tests: list[str], cpu_seconds: float) -> bool:
        """Whether a test fails, or they do not come to an end, when the change is made."""
        file = self.folder / mutant.site.file
        before, stat = file.read_text("utf-8"), file.stat()
        # What is compiled of the change must not be left behind: neither byte code nor machine code.
        cache = self.folder.parent / "cache_of_one"
        shutil.rmtree(cache, ignore_errors=True)
        shutil.copytree(self._cache, cache, copy_function=os.link)
        file.write_text(mutant.source, "utf-8")
        try:
            return (
                self.python(
                    *("-m", "pytest", "-x", *_FAST, *tests),
                    cpu_seconds=cpu_seconds,
                    NUMBA_CACHE_DIR=str(cache),
                    PYTHONDONTWRITEBYTECODE="1",
                )
                != 0
            )
        finally:
            file.write_text(before, "utf-8")
            os.utime(file, ns=(stat.st_atime_ns, stat.st_mtime_ns))


def measured(copies: list[Copy], folder: Path) -> Reach:
    """Run the tests once and return what they reach."""

    def run(copy: Copy, number: int) -> tuple[Path, Path]:
        data, seconds = folder / f"coverage{number}", folder / f"seconds{number}.json"
        suite = [name for name in _SUITES[number] if (copy.folder / name).exists()]
        copy.python(
            *("-m", "coverage", "run", f"--data-file={data}", "--source=twin", "-m", "pytest"),
            *("-p", "tests.mutation.contexts", *_FAST, *suite),
            TWIN_TEST_SECONDS=str(seconds),
        )
        return data, seconds

    with ThreadPoolExecutor(len(copies)) as pool:
        found = list(pool.map(run, copies, range(len(copies))))
    lines: dict[str, dict[int, tuple[str, ...]]] = {}
    took: dict[str, float] = {}
    for copy, (file, seconds) in zip(copies, found, strict=True):
        took |= json.loads(seconds.read_text("utf-8"))
        data = CoverageData(str(file))
        data.read()
        for path in data.measured_files():
            reached = lines.setdefault(Path(path).relative_to(copy.folder).as_posix(), {})
            for line, tests in data.contexts_by_lineno(path).items():
                reached[line] = (*reached.get(line, ()), *filter(None, tests))
    return Reach(lines=lines, seconds=took)


def mirror(file: str, tests: Iterable[str]) -> str:
    """Return the file or folder of tests that mirrors a module, or the nearest folder that has tests."""
    place = Path("tests", *Path(file).parts[1:])
    own = f"{place.parent.as_posix()}/test_{place.stem}.py"
    nearest = (own, *(f"{folder.as_posix()}/" for folder in place.parents))
    return next(prefix for prefix in nearest if any(test.startswith(prefix) for test in tests))
