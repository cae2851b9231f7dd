"""200 small wrong changes, drawn by a seed, each made in a copy of the repository and tested there.

    make mutate                      # all of them: under 90 minutes on two cores
    make mutate ARGS='--again'       # those that survived the last time, with all tests beside their module
    make mutate ARGS='--seed 2 --count 50'

Changes are those of cosmic-ray's operators in mutants.py, one at most of each line, on lines that tests of
the packages reach. For each run the tests that reach its line, the fastest first, until one fails. A change
that no test can notice is listed in equivalent.yaml, with its reason; it is not made.

The exit code is 0 if no more than a tenth is listed so and 85 % of the others are noticed.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from queue import SimpleQueue

import yaml

from tests.mutation.copies import Copy, Reach, measured, mirror
from tests.mutation.mutants import PACKAGES, Mutant, Site, mutant_at, sites_of

ROOT = Path(__file__).parents[2]
EQUIVALENT = Path(__file__).with_name("equivalent.yaml")
FOLDER = ROOT / "build" / "mutation"
WORKERS = 2
MOST_EXCUSED, LEAST_KILLED = 0.10, 0.85


def draw(root: Path, reach: Reach, seed: int, count: int) -> list[Mutant]:
    """Return so many changes, at most one a line, of lines that tests reach.

    Each line has its rank by a hash of its text, so that an edit elsewhere does not draw others.
    """
    places = [root / "twin" / name for name in PACKAGES]
    modules = sorted(m for place in places for m in ([place] if place.is_file() else place.rglob("*.py")))
    lines: dict[tuple[str, str, int], list[Site]] = {}
    for module in modules:
        texts = module.read_text("utf-8").splitlines()
        for site in filter(reach.reaches, sites_of(root, module.relative_to(root).as_posix())):
            text = texts[site.line - 1].strip()
            same = sum(1 for other in texts[: site.line - 1] if other.strip() == text)
            lines.setdefault((site.file, text, same), []).append(site)
    drawn = list[Mutant]()
    for place in sorted(lines, key=lambda place: _hash(seed, *place)):
        _, site = min(enumerate(lines[place]), key=lambda numbered: _hash(seed, *place, numbered[0]))
        mutant = mutant_at(root, site)
        if mutant is not None:
            drawn.append(mutant)
        if len(drawn) == count:
            break
    return drawn


def _hash(*key: object) -> bytes:
    return hashlib.sha256(repr(key).encode()).digest()


def tried(
    copies: list[Copy], reach: Reach, mutants: list[Mutant], *, widely: bool, tell: Callable[[str], None]
) -> list[Mutant]:
    """Make every change, as many at a time as there are copies; return those that no test noticed.

    Args:
        copies: Where.
        reach: Which tests to run.
        mutants: The changes.
        widely: Whether to run all tests beside the module, too, also those that `reach` does not know.
        tell: Told of each.
    """
    free: SimpleQueue[Copy] = SimpleQueue()
    for copy in copies:
        free.put(copy)

    def survives(mutant: Mutant) -> bool:
        tests, copy = reach.tests(mutant.site), free.get()
        if widely:
            tests.append(mirror(mutant.site.file, reach.seconds))
        try:
            noticed = copy.notices(mutant, tests, 30.0 + 5.0 * (reach.cost(tests) + 60.0 * widely))
        finally:
            free.put(copy)
        site = mutant.site
        tell(f"{'killed  ' if noticed else 'SURVIVED'} {mutant.name} ({site.operator}, line {site.line})")
        return not noticed

    with ThreadPoolExecutor(len(copies)) as pool:
        return [mutant for mutant, alive in zip(mutants, pool.map(survives, mutants), strict=True) if alive]


def saved(file: Path) -> Reach:
    """Return what the last run found that tests reach."""
    found = json.loads(file.read_text("utf-8"))
    lines = {
        module: {int(line): tuple(tests) for line, tests in reached.items()}
        for module, reached in found["lines"].items()
    }
    return Reach(lines=lines, seconds=found["seconds"])


def main() -> int:
    """Draw, try, and tell; see the module."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--again", action="store_true", help="only what survived the last time")
    given = parser.parse_args()
    FOLDER.mkdir(parents=True, exist_ok=True)
    copies = [Copy(ROOT, FOLDER / f"copy{number}") for number in range(WORKERS)]
    excused = {entry["change"]: entry["why"] for entry in yaml.safe_load(EQUIVALENT.read_text("utf-8")) or ()}

    def tell(text: str) -> None:
        print(text, flush=True)

    if given.again:
        reach = saved(FOLDER / "reach.json")
        last = set(json.loads((FOLDER / "survivors.json").read_text("utf-8")))
        mutants = [m for m in draw(ROOT, reach, given.seed, given.count) if m.name in last]
    else:
        reach = measured(copies, FOLDER)
        (FOLDER / "reach.json").write_text(json.dumps(asdict(reach)), "utf-8")
        mutants = draw(ROOT, reach, given.seed, given.count)
    judged = [mutant for mutant in mutants if mutant.name not in excused]
    alive = tried(copies, reach, judged, widely=given.again, tell=tell)
    (FOLDER / "survivors.json").write_text(json.dumps([mutant.name for mutant in alive]), "utf-8")
    left_out, killed = len(mutants) - len(judged), len(judged) - len(alive)
    tell(f"{len(mutants)} changes: {left_out} equivalent, {killed} of {len(judged)} others noticed")
    for mutant in alive:
        tell(f"survived: {mutant.name} ({mutant.site.operator}, line {mutant.site.line})")
    few = given.again or left_out <= MOST_EXCUSED * len(mutants)
    enough = few and killed >= LEAST_KILLED * len(judged)
    return 0 if enough else 1


if __name__ == "__main__":
    sys.exit(main())
