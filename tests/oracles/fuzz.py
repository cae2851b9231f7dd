"""Robot files broken at random, but the same way each time.

`python -m tests.oracles.fuzz --count N --seed S` is a long run. Every batch is a process of its own, so
that a crash of MuJoCo is noticed and named by its seeds.
"""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from lxml import etree

from tests.oracles.odd.case import Case
from tests.oracles.odd.run import snapshot, write
from tests.oracles.odd.texts import RICH
from twin.convert.export import export
from twin.convert.inspection import inspect_file
from twin.errors import TwinError
from twin.models import ReadOptions, load
from twin.models.graph import graphviz, svg, tree_text

SLOWEST_S = 15.0
BATCH = 200
CHANGES = 4
"""Most changes of one text."""
NASTY = (
    *(
        "",
        " ",
        "0",
        "-0",
        "-1",
        "1e-300",
        "1e300",
        "-1e10",
        "1e10",
        "1e6",
        "1e-9",
        "inf",
        "nan",
        "1,5",
        "0x10",
    ),
    *(
        "1 2",
        "0 0 0",
        "1e6 -1e6 1e6",
        "0 0 1e-8",
        "1 2 3 4",
        "a",
        "b",
        "c",
        "world",
        "j",
        "wl",
        "🤖",
        "x" * 300,
    ),
    *(
        "../../etc/passwd",
        "a\nb",
        "%s",
        "${1/0}",
        "$(find x)",
        "true",
        "fixed",
        "floating",
        "planar",
        "prismatic",
    ),
    *("revolute", "continuous", "lidar", "imu", "camera", "position", "effort", "m.stl", "package://x/m.stl"),
)
TAGS = (
    "link",
    "joint",
    "inertial",
    "visual",
    "collision",
    "geometry",
    "origin",
    "limit",
    "mimic",
    "gazebo",
    "q",
)
TETRAHEDRON = "solid t\n" + "".join(
    "facet normal 0 0 0\nouter loop\n"
    + "".join(f"vertex {x} {y} {z}\n" for x, y, z in corners)
    + "endloop\nendfacet\n"
    for corners in (
        ((0, 0, 0), (0, 1, 0), (1, 0, 0)),
        ((0, 0, 0), (1, 0, 0), (0, 0, 1)),
        ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
        ((0, 0, 0), (0, 0, 1), (0, 1, 0)),
    )
) + "endsolid t\n"  # fmt: skip


def broken(seed: int) -> bytes:
    """Return a robot's text with some changes, always the same for a seed."""
    rng = np.random.Generator(np.random.Philox(seed))
    text = RICH[int(rng.integers(len(RICH)))]
    changes = int(rng.integers(1, CHANGES + 1))
    if rng.random() < 0.15:
        return _bytes(text.encode(), changes, rng)
    root = etree.fromstring(text)
    for _ in range(changes):
        kinds = (_drop, _double, _swap, _value, _value, _value, _value, _text, _text, _rename, _exchange)
        kinds[int(rng.integers(len(kinds)))](root, rng)
    return bytes(etree.tostring(root))


def endure(seed: int, folder: Path) -> str:
    """Read, inspect and export a broken robot; return a word for the outcome.

    Raises:
        AssertionError: It took too long, or something was written outside of the output folder.
        Exception: Whatever escapes that is not a `TwinError`.
    """
    file = write(Case(urdf=broken(seed), files={"m.stl": TETRAHEDRON}), folder)
    before, start = snapshot(folder), time.process_time()
    outcome = "accepted"
    out = folder / "out"
    try:
        robot = load(
            file, ReadOptions(repair=seed % 2 == 0, missing_mesh="skip" if seed % 3 == 0 else "error")
        )
        for draw in (tree_text, graphviz, svg):
            draw(robot)
        export(robot, out, base="fixed" if seed % 5 == 0 else "free")
    except TwinError as fault:
        outcome = fault.problems[0].code or "no code"
        assert not out.exists(), "an output in spite of an error"
    inspect_file(file)
    assert time.process_time() - start < SLOWEST_S, "too slow"
    after = {name: seen for name, seen in snapshot(folder).items() if name.partition("/")[0] != "out"}
    assert after == before, f"written outside: {after.keys() ^ before.keys()}"
    return outcome


def run(seeds: range) -> dict[str, int]:
    """Endure many; return how often each outcome came about.

    Raises:
        AssertionError: Naming the seed.
    """
    outcomes: dict[str, int] = {}
    for seed in seeds:
        with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                outcome = endure(seed, Path(folder))
            except Exception as error:
                raise AssertionError(f"seed {seed}: {type(error).__name__}: {error}") from error
        outcomes[outcome] = outcomes.get(outcome, 0) + 1
    return outcomes


def _pick(root: etree._Element, rng: np.random.Generator) -> etree._Element:
    elements = list(root.iter(etree.Element))[1:]
    return elements[int(rng.integers(len(elements)))] if elements else root


def _one(words: tuple[str, ...], rng: np.random.Generator) -> str:
    return words[int(rng.integers(len(words)))]


def _drop(root: etree._Element, rng: np.random.Generator) -> None:
    element = _pick(root, rng)
    if element is not root:
        element.getparent().remove(element)


def _double(root: etree._Element, rng: np.random.Generator) -> None:
    element = _pick(root, rng)
    _pick(root, rng).append(etree.fromstring(etree.tostring(element, with_tail=False)))


def _swap(root: etree._Element, rng: np.random.Generator) -> None:
    one, other = _pick(root, rng), _pick(root, rng)
    one.tag, other.tag = other.tag, one.tag


def _value(root: etree._Element, rng: np.random.Generator) -> None:
    holders = [element for element in root.iter(etree.Element) if element.attrib]
    element = holders[int(rng.integers(len(holders)))] if holders else root
    names = tuple(element.attrib) or ("name",)
    words = element.get(_one(names, rng), "").split()
    nasty = _one(NASTY, rng)
    if len(words) > 1 and rng.random() < 0.5:
        words[int(rng.integers(len(words)))] = nasty
        nasty = " ".join(words)
    element.set(_one(names, rng), nasty)


def _text(root: etree._Element, rng: np.random.Generator) -> None:
    holders = [element for element in root.iter(etree.Element) if (element.text or "").strip()]
    if holders:
        holders[int(rng.integers(len(holders)))].text = _one(NASTY, rng)


def _rename(root: etree._Element, rng: np.random.Generator) -> None:
    _pick(root, rng).tag = _one(TAGS, rng)


def _exchange(root: etree._Element, rng: np.random.Generator) -> None:
    """Give an element the attributes of another one."""
    one, other = _pick(root, rng), _pick(root, rng)
    for name, value in other.attrib.items():
        one.set(name, value)


def _bytes(text: bytes, changes: int, rng: np.random.Generator) -> bytes:
    content = bytearray(text)
    for _ in range(changes):
        start = int(rng.integers(len(content)))
        kind = int(rng.integers(4))
        if kind == 0:
            content[start] = int(rng.integers(256))
        elif kind == 1:
            del content[start : start + int(rng.integers(1, 40))]
        elif kind == 2:
            content[start:start] = content[start : start + int(rng.integers(1, 200))]
        else:
            content[start:start] = _one(NASTY, rng).encode()
    return bytes(content)


def main(say: Callable[[str], object]) -> int:
    """Run many seeds in batches; return how many batches failed."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--here", action="store_true", help="one batch, in this process")
    options = parser.parse_args()
    end = options.seed + options.count
    if options.here:
        say(str(run(range(options.seed, end))))
        return 0
    failed, first = 0, options.seed
    while first < end:
        count = min(BATCH, end - first)
        arguments = ["--here", "--seed", str(first), "--count", str(count)]
        done = subprocess.run(
            [sys.executable, "-X", "faulthandler", "-m", __spec__.name, *arguments],
            capture_output=True,
            text=True,
            check=False,
            timeout=SLOWEST_S * count,
        )
        if done.returncode:
            failed += 1
            cause = signal.Signals(-done.returncode).name if done.returncode < 0 else "error"
            say(f"seeds {first} to {first + count - 1}: {cause}\n{done.stderr[-3000:]}")
        else:
            say(f"seeds {first} to {first + count - 1}: {done.stdout.strip()}")
        first += count
    return failed


if __name__ == "__main__":
    sys.exit(main(lambda text: sys.stdout.write(text + "\n")))
