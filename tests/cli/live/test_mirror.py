"""`twin mirror` from a shell; what it does beside a robot: tests/live/mirror."""

from __future__ import annotations

import json
import re
from pathlib import Path

from tests.cli.conftest import Invoke
from twin.bridge.wire.session import SessionConfig
from twin.live.plant import Plant
from twin.scenario.schema import load


def test_a_bag_is_followed_recorded_and_asked_for_the_past(invoke: Invoke, tmp_path: Path) -> None:
    bag, own = tmp_path / "bag", tmp_path / "own"
    network = SessionConfig()
    with Plant(load("diff_bot_figure8"), network=network, autonomy=True, pace=None, bag=bag) as robots:
        world = robots.run.run.world
        robots.advance(lambda: world.time_ns >= 3e9)
    code, output, error = invoke(
        "mirror", "diff_bot_figure8", "--bag", bag, "--record", own, "--out", tmp_path
    )
    assert code == 0
    assert re.findall(r"^[\d.]+ s: (\w+)$", error, re.MULTILINE) == ["model", "shadow"]
    assert output.startswith("diff_bot  SHADOW\n")
    verdict = json.loads((tmp_path / "verdict.json").read_text())
    assert (verdict["verdict"], verdict["label"]) == ("pass", "shadow")
    assert verdict["metrics"]["shadow_s"] > 2.0
    assert verdict["metrics"]["diff_bot_position_max"] < 0.05
    assert (tmp_path / "diff_bot_figure8.rrd").exists()
    code, output, _ = invoke("mirror", "--status", "--bag", own, "--at", 2)
    assert code == 0
    assert output.startswith("diff_bot  SHADOW\n")
    assert "  because     a bag obeys no commands\n" in output


def test_who_heard_no_robot_fails_if_that_is_judged(invoke: Invoke, tmp_path: Path) -> None:
    with Plant(load("diff_bot_figure8"), network=SessionConfig(), pace=None, bag=tmp_path / "bag") as robots:
        robots.advance(lambda: True)
    pair = tmp_path / "pair.yaml"
    both = "{model: diff_bot, name: a}, {model: diff_bot, name: b, pose: {x: 2}}"
    pair.write_text(f"name: pair\nduration: 1 s\nrobots: [{both}]\nchecks: [{{no_collision: }}]\n")
    words = ["mirror", pair, "--bag", tmp_path / "bag"]
    assert invoke(*words)[0] == 0, "nothing was judged"
    code, output, _ = invoke(*words, "--out", tmp_path / "out")
    assert code == 1
    assert "no pose of a physical robot was heard" in output


def test_mistakes_are_a_sentence(invoke: Invoke, tmp_path: Path) -> None:
    for words, said in (
        (("--seed", "1"), "a scenario, or --status"),
        (("diff_bot_figure8", "--bag", tmp_path, "--autonomy", "all"), "a bag obeys no commands"),
        (("diff_bot_figure8", "--bag", tmp_path / "none"), "cannot be read"),
        (("diff_bot_figure8", "--connect", "tcp/127.0.0.1:1"), "tcp/127.0.0.1:1"),
        (("no_such",), "no_such"),
    ):
        code, _, error = invoke("mirror", *words)
        assert code == 2
        assert said in " ".join(error.split())
