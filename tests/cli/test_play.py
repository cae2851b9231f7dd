"""`twin play`: pictures of a recording; windows are those of the viewer."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from tests.cli.conftest import Invoke
from twin.recording.player import has_vulkan


@pytest.mark.skipif(not has_vulkan(), reason="no Vulkan driver: apt-get install mesa-vulkan-drivers")
def test_a_picture_of_a_view(invoke: Invoke, tmp_path: Path) -> None:
    assert invoke("run", "diff_bot_figure8", "--set", "duration=1s", "--out", tmp_path)[0] == 1
    picture = tmp_path / "pictures" / "map.png"
    assert invoke("play", tmp_path, "--screenshot", picture, "--at", 0.5, "--view", "Map") == (0, "", "")
    with Image.open(picture) as image:
        assert min(image.size) > 50


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--at", "1"), "--at and --view are of a picture: add --screenshot PNG"),
        (("--screenshot", "shot.jpg"), "shot.jpg: not a picture that can be written; valid: *.png"),
        (("--screenshot", "."), "--screenshot .: cannot be written: it is a folder; name a file"),
        (("--screenshot", "a.png"), "run.rrd: not a Rerun recording"),
    ],
)
def test_what_is_no_picture_is_refused(
    invoke: Invoke, tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    (tmp_path / "run.rrd").write_text("nothing")
    status, out, err = invoke("play", tmp_path, *words)
    assert (status, out) == (2, "")
    assert said in " ".join(err.split())
