"""`twin map`: what the commands print and write."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from twin.navigation.maps.occupancy_map import OccupancyMap

Invoke = Callable[..., tuple[int, str, str]]


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")


def test_info_has_the_golden_counts_of_published_maps(invoke: Invoke, shared_data: Path) -> None:
    golden = json.loads((shared_data / "maps" / "golden_counts.json").read_text())
    assert golden
    for name, want in golden.items():
        code, out, _ = invoke("map", "info", str(shared_data / "maps" / name), "--json")
        facts = json.loads(out)
        assert code == 0
        assert [facts[key] for key in ("free", "occupied", "unknown", "between")] == [
            want["free"], want["occ"], want["unk"], want["mid"],
        ], name  # fmt: skip
        assert (facts["width"], facts["height"], facts["mode"]) == (want["w"], want["h"], want["mode"])
        assert [facts["resolution"], *facts["origin"]] == pytest.approx([want["res"], *want["origin"]])
        assert facts["negate"] == bool(want["negate"])


def test_info_for_people(invoke: Invoke) -> None:
    _, out, _ = invoke("map", "info", "warehouse")
    assert "420 x 300 of 0.05 m" in out
    assert "21 x 15 m" in out
    assert [line.split()[:2] for line in out.splitlines()[-3:]] == [
        ["free", "104316"], ["occupied", "13188"], ["unknown", "8496"],
    ]  # fmt: skip


@pytest.mark.parametrize("output", ["", ".", ".."])
def test_an_output_without_a_name_is_refused(invoke: Invoke, tmp_path: Path, output: str) -> None:
    code, _, err = invoke("map", "convert", "warehouse", "-o", output)
    assert (code, "it is a folder; name a file" in err) == (2, True)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("size", "told"),
    [("1e-300", "more than 400000000 cells"), ("1e300", "valid is a positive number of metres up to 1e+06")],
)
def test_cells_of_no_size_are_refused(invoke: Invoke, size: str, told: str) -> None:
    code, _, err = invoke("map", "convert", "warehouse", "-o", "new.yaml", "--resolution", size)
    assert (code, told in err) == (2, True)


def test_a_map_that_is_not_there(invoke: Invoke) -> None:
    code, _, err = invoke("map", "info", "warehuose")
    assert code == 2
    assert "did you mean 'warehouse'?" in err


def test_show_draws_in_the_terminal_and_into_files(invoke: Invoke) -> None:
    _, out, _ = invoke("map", "show", "warehouse")
    lines = out.splitlines()
    assert max(map(len, lines)) <= 100
    assert {"█", "░"} <= set(out)
    for name in ("picture.png", "picture.svg"):
        assert invoke("map", "show", "warehouse", "-o", name)[0] == 0
    with Image.open("picture.png") as picture:
        assert picture.size == (840, 600)
    assert Path("picture.svg").read_text().startswith("<svg")
    code, _, err = invoke("map", "show", "warehouse", "-o", "picture.gif")
    assert (code, "must end in .png or .svg" in err) == (2, True)


def test_convert_keeps_the_cells(invoke: Invoke) -> None:
    want = OccupancyMap.load(Path(__file__).parents[3] / "twin/warehouse/maps/warehouse.yaml")
    for name, *options in (("a",), ("b", "--fmt", "png"), ("c", "--mode", "scale"), ("d", "--mode", "raw")):
        code, out, _ = invoke("map", "convert", "warehouse", "-o", name, *options)
        assert (code, out.startswith(f"{name}.yaml and {name}.")) == (0, True)
        assert np.array_equal(OccupancyMap.load(f"{name}.yaml").data, want.data)
    assert [Path(name).is_file() for name in ("a.pgm", "b.png", "c.png", "d.pgm")] == [True] * 4
    invoke("map", "convert", "a.yaml", "-o", "coarse.yaml", "--resolution", "0.1")
    assert OccupancyMap.load("coarse.yaml").data.shape == (150, 210)
    code, _, err = invoke("map", "convert", "a.yaml", "-o", "a")
    assert (code, "is the map itself" in err) == (2, True)


def test_a_scenarios_arena_is_rendered(invoke: Invoke) -> None:
    scenario = Path(__file__).parents[3] / "scenarios" / "warehouse.yaml"
    for name, source in (("arena", "warehouse"), ("scenario", str(scenario))):
        assert invoke("map", "render", source, "-o", name)[0] == 0
    drawn = OccupancyMap.load("arena.yaml")
    assert np.array_equal(drawn.data, OccupancyMap.load("scenario.yaml").data)
    assert drawn.counts()["free"] == 104316
    Path("empty.yaml").write_text((scenario.parent / "diff_bot_figure8.yaml").read_text())
    code, _, err = invoke("map", "render", "empty.yaml", "-o", "x")
    assert (code, "there is nothing to draw" in err) == (2, True)


@pytest.mark.parametrize(
    ("option", "words"),
    [
        (("--height", "nan"), "height nan; valid is a number of metres"),
        (("--margin", "inf"), "margin inf; valid is a number of metres"),
        (("--margin", "1e6"), "valid are at most 400000000"),
        (("--resolution", "nan"), "--resolution"),
    ],
)
def test_a_rendering_of_no_size_is_refused(invoke: Invoke, option: tuple[str, str], words: str) -> None:
    code, _, err = invoke("map", "render", "warehouse", "-o", "new.yaml", *option)
    assert code == 2
    assert words in err
    assert not Path("new.yaml").exists()


def test_zones_are_drawn_erased_and_shown(invoke: Invoke) -> None:
    keepout = ("map", "zone", "keepout", "keepout.yaml")
    _, out, _ = invoke(
        *keepout, "--map", "warehouse", "--rectangle", "1,1,2,3", "--polygon", "-4 1 -2 1 -3 2"
    )
    assert "zones cover 3.00 m²" in out
    _, out, _ = invoke(*keepout, "--circle", "1.5,2,0.5", "--erase")
    assert "zones cover 2.2" in out
    invoke(
        "map", "zone", "speed", "slow", "--map", "warehouse", "--rectangle", "-1,-1,1,0", "--percent", "35"
    )
    mask = OccupancyMap.load("slow.yaml")
    assert mask.value_at([[0.0, -0.5], [0.0, 0.5]]).tolist() == [35, 0]
    text = Path("slow.yaml").read_text()
    assert text.startswith("image: slow.png\nmode: scale\n")
    assert "occupied_thresh: 1.000" in text
    assert invoke("map", "show", "warehouse", "--mask", "keepout.yaml", "-o", "zones.png")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("new.yaml", "--rectangle", "0,0,1,1"), "--map MAP"),
        (("new.yaml", "--map", "warehouse"), "give a zone"),
        (("new.yaml", "--map", "warehouse", "--rectangle", "0,0,1"), "must be 4 numbers"),
        (("new.yaml", "--map", "warehouse", "--circle", "nan,0,1"), "must be 3 numbers"),
        (("new.yaml", "--map", "warehouse", "--polygon", "0,0,1,1"), "three points or more"),
        (("new.yaml", "--map", "warehouse", "--circle", "0,0,-1"), "valid is a positive number"),
        (("new.yaml", "--map", "warehouse", "--circle", "99,0,1"), "no cell of the mask"),
    ],
)
def test_zones_that_cannot_be_drawn(invoke: Invoke, arguments: tuple[str, ...], words: str) -> None:
    code, _, err = invoke("map", "zone", "keepout", *arguments)
    assert code == 2
    assert words in err
    assert not Path("new.yaml").exists()


def test_the_map_of_a_graph_is_saved(tmp_path: Path) -> None:
    """In processes of their own: a map server that listens, and `twin map save`."""
    import subprocess

    from tests.processes import free_endpoint

    endpoint = free_endpoint()
    graph = Path(__file__).with_name("map_graph.py")
    with subprocess.Popen(
        [sys.executable, str(graph), endpoint], stdout=subprocess.PIPE, stdin=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        command = [sys.executable, "-m", "twin.cli", "map", "save", "--connect", endpoint]
        root = Path(__file__).parents[3]

        def save(*arguments: str) -> subprocess.CompletedProcess[str]:
            return subprocess.run(
                [*command, *arguments], capture_output=True, text=True, cwd=root, check=False, timeout=120
            )

        done = save("-f", str(tmp_path / "saved"), "--fmt", "png")
        assert done.returncode == 0, done.stderr
        assert "saved.png: 4 x 3 cells of 0.05 m" in done.stdout
        missing = save("-t", "nowhere", "-f", str(tmp_path / "x"), "--save_map_timeout", "0.3")
        assert missing.returncode == 2
        assert "no map came on /nowhere in 0.3 s" in missing.stderr
        process.communicate()
    loaded = OccupancyMap.load(tmp_path / "saved.yaml")
    assert loaded.data.tolist() == [[0, 0, 0, 100], [-1, 0, 0, 0], [0, 100, 0, 0]]
    assert (loaded.resolution, loaded.origin.x) == (0.05, -1.5)
