"""The page of a run: whole, offline, readable, and there even if the recording is not."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from twin.errors import RecordingError, SimulationError
from twin.experiments.report import photos
from twin.experiments.report.page import write_report
from twin.experiments.report.told import read_run
from twin.runtime import run
from twin.scenario.checks import CheckResult
from twin.scenario.schema import load
from twin.scenario.verdict import Verdict

SCENARIO = """\
name: bend
duration: 6 s
world: {obstacles: [{name: crate, pose: {x: 2 m}, size: [0.4, 0.4, 0.4]}]}
robots: [{model: diff_bot}]
mission:
  type: velocity_profile
  robot: diff_bot
  steps: [{duration: 4 s, linear: 0.4 m/s, angular: 20 deg/s}]
checks: [{mission_succeeded: }, {driven_distance: {max: 50 cm}}, {energy: {max: 100 J}}]
"""
VOID = {"meta", "img", "br", "link", "hr"}
HTML = {"table", "tr", "td", "th", "section", "svg", "figure", "main", "details"}


class Page(HTMLParser):
    """What a page is made of; fails where an element is not closed as it was opened."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.addresses: list[str] = []
        self.images_without_words = 0
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        given = dict(attributes)
        self.addresses += [str(given[key]) for key in ("src", "href", "xlink:href") if key in given]
        self.images_without_words += tag == "img" and not given.get("alt")
        self.images_without_words += tag == "svg" and not given.get("aria-label")
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bend")
    file = folder / "bend.yaml"
    file.write_text(SCENARIO, encoding="utf-8")
    out = folder / "run"
    replace(run(load(file), out=out), command="twin run bend.yaml --seed 4").write(out)
    return out


@pytest.fixture(scope="module")
def page(recorded: Path) -> str:
    file = recorded.parent / "report.html"
    assert write_report(recorded, file) == 1
    return file.read_text(encoding="utf-8")


def test_it_is_one_small_file_that_needs_no_network(page: str) -> None:
    assert len(page) < 2_000_000
    parsed = Page(page)
    assert all(address.startswith(("data:", "#")) for address in parsed.addresses)
    assert set(re.findall(r"https?://[^\"' ]+", page)) <= {
        "http://www.w3.org/2000/svg",
        "http://www.w3.org/1999/xlink",
    }
    assert parsed.images_without_words == 0
    assert re.findall(r"url\((?!#)", page) == []


def test_it_has_the_verdict_and_how_to_make_the_run_again(page: str, recorded: Path) -> None:
    verdict = json.loads((recorded / "verdict.json").read_text(encoding="utf-8"))
    text = re.sub(r"<[^>]*>", " ", page)
    assert re.search(r"✗ fails\s+driven_distance\s+1\.6\d* m\s+0\.5 m", text)
    assert re.search(r"✓ holds\s+energy", text)
    assert "twin run bend.yaml --seed 4" in page
    for told in (verdict["digest"], verdict["cpu"], *verdict["versions"].values()):
        assert told in page


def test_it_draws_path_and_speeds_in_the_colours_of_the_page(page: str) -> None:
    drawings = re.findall(r"<svg.*?</svg>", page, re.DOTALL)
    assert len(drawings) == 2
    for drawing in drawings:
        ElementTree.fromstring(drawing)
        assert set(re.findall(r"(?:fill|stroke): (#\w+)", drawing)) <= {"#ffffff", "#000000"}
    path, series = drawings
    assert {"var(--truth)", "var(--odometry)", "var(--solid)"} <= set(re.findall(r"var\(--\w+\)", path))
    assert "forward velocity" in series
    assert set(re.findall(r"var\(--(\w+)\)", page)) <= set(re.findall(r"--(\w+):", page))
    ids = re.findall(r' id="([^"]+)"', page)
    assert all(f"#{name}" in page for name in ids)


def test_what_failed_is_a_moment_worth_a_look(recorded: Path) -> None:
    told = read_run(recorded)
    (moment,) = told.moments
    assert (moment.title, moment.bad) == ("driven_distance fails", True)
    times, path = told.truth("diff_bot")
    assert len(times) == len(path) > 100
    assert path[-1] == pytest.approx([1.13, 0.95], abs=0.1)  # an arc of 80 degrees, 1.15 m around
    assert [name for _, name in told.sights] == [
        "start",
        "end",
        "1: driven_distance fails",
        "+0.40 m/s, +0.35 rad/s",
        "done",
    ]


def test_without_a_recording_the_rest_is_there(recorded: Path, tmp_path: Path) -> None:
    shutil.copytree(recorded, tmp_path / "run")
    file = tmp_path / "run" / "bend.rrd"
    whole = file.read_bytes()
    for content, says in ((None, "The run was not recorded."), (b"not a recording", "not a Rerun recording")):
        file.unlink() if content is None else file.write_bytes(content)
        write_report(tmp_path / "run", tmp_path / "report.html")
        text = (tmp_path / "report.html").read_text(encoding="utf-8")
        Page(text)
        assert says in text
        assert "driven_distance" in text
    file.write_bytes(whole[: len(whole) // 2])
    write_report(tmp_path / "run", tmp_path / "report.html")
    assert "the recording is damaged" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_it_says_what_became_of_faults(recorded: Path, tmp_path: Path) -> None:
    verdict = json.loads((recorded / "verdict.json").read_text(encoding="utf-8"))
    fault = {"name": "loss", "kind": "loss", "at_s": 1.5, "end_s": None}
    verdict["faults"] = [
        {**fault, "outcome": "landed", "effect": "3 of 9 messages lost"},
        {**fault, "name": "late", "at_s": None, "outcome": "not_reached", "effect": ""},
    ]
    (tmp_path / "verdict.json").write_text(json.dumps(verdict), encoding="utf-8")
    write_report(tmp_path, tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    Page(text)
    words = " ".join(re.sub(r"<[^>]*>", " ", text).split())
    assert "landed loss 1.50 s 3 of 9 messages lost not reached late" in words


def test_without_opengl_pictures_are_left_out_in_a_sentence(
    recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*_: Any) -> None:
        raise SimulationError("MuJoCo needs EGL or OSMesa")

    monkeypatch.setattr(photos, "take", none)
    write_report(recorded, tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Pictures are left out: MuJoCo needs EGL or OSMesa." in text
    assert "<svg" in text


def test_of_many_runs_the_failures_come_first(recorded: Path, tmp_path: Path) -> None:
    good = CheckResult(name="energy", passed=True, value=1.0, limit=2.0, unit="J", at_s=1.0)
    for name, made in {
        "01": Verdict(scenario="good", seed=1, checks=(good,)),
        "02": Verdict(scenario="broken", seed=2, error="<script>alert('no')</script>\nand more"),
        "03": Verdict(scenario="better", seed=3, checks=(good,), test="better[seed=3]"),
    }.items():
        made.write(tmp_path / "runs" / name)
    shutil.copytree(recorded, tmp_path / "runs" / "04")
    assert write_report(tmp_path / "runs", tmp_path / "report.html") == 4
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    Page(text)
    assert "<script" not in text
    assert "2 pass, 1 fail, 1 error" in text
    order = [text.index(f">{name}<") for name in ("broken", "bend", "good", "better[seed=3]")]
    assert order == sorted(order)
    linked = re.findall(r'href="#(run-[^"]+)"', text)
    assert len(linked) == 2
    assert all(f'id="{name}"' in text for name in linked)
    assert text.count('aria-label="The floor from above') == 1


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, r"no run in this folder; a run's folder holds verdict\.json"),
        ("", r"verdict\.json: cannot be read"),
        ("[]", r"verdict\.json: is no verdict of a run"),
        ('{"scenario": "a"}', r"verdict\.json: is no verdict of a run"),
    ],
)
def test_what_is_no_run(tmp_path: Path, content: str | None, says: str) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    if content is not None:
        (folder / "verdict.json").write_text(content, encoding="utf-8")
    with pytest.raises(RecordingError, match=says):
        write_report(folder, tmp_path / "report.html")
    with pytest.raises(RecordingError, match="no such folder"):
        write_report(tmp_path / "absent", tmp_path / "report.html")
    assert not (tmp_path / "report.html").exists()
