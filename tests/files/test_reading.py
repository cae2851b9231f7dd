"""What is no regular file is refused at once: opening a pipe would wait for somebody to write into it."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from twin.bridge.bags.reader import BagReader
from twin.bridge.parameters import files
from twin.errors import ModelError, ScenarioError, TwinError
from twin.files.reading import read_text
from twin.models import load
from twin.navigation.behavior_trees.xml_file import read_file
from twin.navigation.mapping.slam import Slam
from twin.navigation.maps.map_image import read_image
from twin.navigation.maps.map_yaml import read_metadata
from twin.recording.read_back import check_recording
from twin.strict_yaml.document import read

pytestmark = pytest.mark.timeout(20)

READERS: dict[str, Callable[[Path], object]] = {
    "robot": load,
    "scenario": lambda path: read(path, ScenarioError),
    "bag": BagReader,
    "parameters": files.read,
    "pose graph": Slam.load,
    "map": read_metadata,
    "map image": read_image,
    "recording": check_recording,
}


@pytest.fixture
def pipe(tmp_path: Path) -> Path:
    os.mkfifo(tmp_path / "pipe")
    return tmp_path / "pipe"


@pytest.mark.parametrize("kind", READERS)
def test_a_pipe_is_refused_at_once(pipe: Path, kind: str) -> None:
    with pytest.raises((TwinError, OSError), match="is a pipe, not a regular file"):
        READERS[kind](pipe)


def test_a_pipe_as_behaviour_tree_is_told(pipe: Path) -> None:
    (problem,) = read_file(pipe).problems
    assert "is a pipe, not a regular file" in problem.message


def test_a_pipe_as_the_image_of_a_map_is_told(pipe: Path) -> None:
    file = pipe.with_name("map.yaml")
    file.write_text(
        "{image: pipe, resolution: 0.05, origin: [0, 0, 0], occupied_thresh: 0.6, free_thresh: 0.2}"
    )
    with pytest.raises(TwinError, match="is a pipe, not a regular file"):
        read_metadata(file)


@pytest.mark.parametrize(
    "tag", ['<xacro:include filename="pipe"/>', "<link name=\"a${xacro.load_yaml('pipe')}\"/>"]
)
def test_a_xacro_file_cannot_wait_for_a_pipe(pipe: Path, tag: str) -> None:
    file = pipe.with_name("r.urdf.xacro")
    file.write_text(f'<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">{tag}</robot>')
    with pytest.raises(ModelError, match="is a pipe, not a regular file"):
        load(file)


@pytest.mark.parametrize(("path", "kind"), [("/dev/zero", "a device"), ("/dev", "a folder")])
def test_devices_and_folders_are_named(path: str, kind: str) -> None:
    with pytest.raises(OSError, match=f"it is {kind}, not a regular file"):
        read_text(Path(path))


def test_a_pipe_of_the_shell_is_read() -> None:
    """As in `twin run <(sed s/warehouse/shop/ a.yaml)`."""
    reader, writer = os.pipe()
    os.write(writer, b"name: a\n")
    os.close(writer)
    assert read(Path(f"/dev/fd/{reader}"), ScenarioError).data == {"name": "a"}
    os.close(reader)


def test_a_file_is_read_up_to_a_limit_with_its_lines_as_python_reads_them(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_bytes("é\r\nb\rc\n".encode())
    assert read_text(file) == file.read_text("utf-8")
    with pytest.raises(OSError, match="more than 5 bytes"):
        read_text(file, 5)
