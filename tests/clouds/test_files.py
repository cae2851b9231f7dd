"""Files of points: what others wrote is read, what is written others read, and no file can do harm."""

from __future__ import annotations

import struct
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from twin.clouds.colours import channels
from twin.clouds.files import read_cloud, write_cloud
from twin.clouds.files.lzf import compress, decompress
from twin.clouds.files.pcd import parse_pcd, pcd_of
from twin.clouds.files.ply import ply_of
from twin.clouds.points import make_points
from twin.errors import CloudError

DATA = Path(__file__).parent / "data"
ENCODINGS: list[Any] = ["ascii", "binary", "binary_compressed"]


def pcd(n: int, data: str = "ascii", body: str = "", **lines: str) -> str:
    """Return a file of x, y, z, some lines of whose header are others."""
    header = {
        "VERSION": "0.7",
        "FIELDS": "x y z",
        "SIZE": "4 4 4",
        "TYPE": "F F F",
        "COUNT": "1 1 1",
        "WIDTH": str(n),
        "HEIGHT": "1",
        "VIEWPOINT": "0 0 0 1 0 0 0",
        "POINTS": str(n),
        **lines,
        "DATA": data,
    }
    return "".join(f"{key} {words}\n" for key, words in header.items() if words) + body


def golden() -> np.ndarray:
    """Return what the golden files hold."""
    i = np.arange(64)
    points = np.zeros(
        64,
        [
            *((name, "<f4") for name in ("x", "y", "z", "intensity")),
            *(("ring", "<u2"), ("label", "<i4"), ("time", "<f8")),
        ],
    )
    points["x"], points["y"], points["z"] = i % 8 * 0.25, i // 8 * 0.5 - 1, np.sqrt(i)
    points["intensity"], points["ring"], points["label"], points["time"] = (
        i * 1.5,
        i % 16,
        -i * 100000,
        i * 0.1,
    )
    for axis in "xyz":
        points[axis][5] = np.nan
    return points


def mixed(n: int = 50) -> np.ndarray:
    """Return points of every type, one field of three numbers, with colours whose float is odd."""
    generator = np.random.default_rng(0)
    points = np.zeros(
        n,
        [
            *(("x", "<f4"), ("y", "<f4"), ("z", "<f8"), ("rgb", "<f4"), ("a", "i1"), ("b", "u1")),
            *(("c", "<i2"), ("d", "<u8"), ("e", "<i8"), ("normal", "<f4", (3,))),
        ],
    )
    for name in points.dtype.names or ():
        points[name] = (100 * generator.normal(size=points[name].shape)).astype(points.dtype[name].base)
    points["rgb"] = generator.integers(0, 2**24, n).astype(np.uint32).view(np.float32)
    points["x"][3] = np.nan
    return points


def equal(one: np.ndarray, other: np.ndarray) -> bool:
    return one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()


@pytest.mark.parametrize("name", ["pypcd4_binary", "pypcd4_compressed", "pcl_binary", "pcl_compressed"])
def test_what_others_wrote_as_bytes_is_read(name: str) -> None:
    assert equal(read_cloud(DATA / f"{name}.pcd"), golden())


@pytest.mark.parametrize("name", ["pypcd4_ascii", "pcl_ascii"])
def test_what_others_wrote_as_text_is_read_as_precisely_as_it_is_written(name: str) -> None:
    read, truth = read_cloud(DATA / f"{name}.pcd"), golden()
    for field in truth.dtype.names or ():
        np.testing.assert_allclose(read[field], truth[field], rtol=1e-6, atol=1e-9)


def test_what_is_written_is_what_pcl_writes() -> None:
    assert (DATA / "pcl_binary.pcd").read_bytes().startswith(pcd_of(golden(), "binary"))


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("shape", [(50,), (5, 10), (0,)])
def test_every_bit_of_a_cloud_survives_a_pcd_file(encoding: Any, shape: Any, tmp_path: Path) -> None:
    points = mixed()[: int(np.prod(shape))].reshape(shape)
    write_cloud(tmp_path / "cloud.pcd", points, encoding)
    read = read_cloud(tmp_path / "cloud.pcd")
    if encoding == "ascii":  # as PCL: text has colours as whole numbers
        assert read.dtype["rgb"] == np.uint32
        read = read.view(points.dtype)
    assert equal(read, points)


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_a_ply_file_has_colours_as_everybody_expects(encoding: Any, tmp_path: Path) -> None:
    points = mixed()[["x", "y", "z", "rgb", "a", "b", "c"]]
    write_cloud(tmp_path / "cloud.ply", points, encoding)
    assert (
        b"property uchar red\nproperty uchar green\nproperty uchar blue\n"
        in (tmp_path / "cloud.ply").read_bytes()
    )
    read = read_cloud(tmp_path / "cloud.ply")
    np.testing.assert_array_equal(channels(read["rgb"]), channels(points["rgb"]))
    for name in ("x", "y", "z", "a", "b", "c"):
        np.testing.assert_array_equal(read[name], points[name])


def test_a_big_endian_mesh_is_read_up_to_its_faces(tmp_path: Path) -> None:
    header = (
        "ply\r\nformat binary_big_endian 1.0\r\ncomment a mesh\r\nelement camera 1\r\nproperty double f\r\n"
        "element vertex 2\r\nproperty float x\r\nproperty float y\r\nproperty float z\r\n"
        "element face 1\r\nproperty list uchar int vertex_indices\r\nend_header\r\n"
    )
    body = struct.pack(">d6f", 9.0, 1, 2, 3, 4, 5, 6) + b"\x03" + struct.pack(">3i", 0, 1, 0)
    (tmp_path / "mesh.ply").write_bytes(header.replace("\r\n", "\n").encode() + body)
    np.testing.assert_array_equal(read_cloud(tmp_path / "mesh.ply")["z"], [3, 6])


def test_text_of_a_mesh_is_read_past_what_stands_before_its_vertices(tmp_path: Path) -> None:
    (tmp_path / "mesh.ply").write_text(
        "ply\nformat ascii 1.0\nelement camera 1\nproperty float f\nelement vertex 2\nproperty float x\n"
        "property float y\nproperty float z\nend_header\n7\n1 2 3\n4 5 six\n"
    )
    with pytest.raises(CloudError, match=r"mesh.ply:12: is '4 5 six'; valid are numbers for x, y, z"):
        read_cloud(tmp_path / "mesh.ply")


def test_padding_and_old_headers_are_understood() -> None:
    header = "# .PCD v.5\nVERSION .5\nCOLUMNS x _ y z\nSIZE 4 1 4 4\nTYPE F U F F\nCOUNT 1 4 1 1\n"
    header += "WIDTH 2\nHEIGHT 1\n"
    body = struct.pack("<f4s2f", 1, b"????", 2, 3) + struct.pack("<f4s2f", 4, b"????", 5, 6)
    points = parse_pcd(f"{header}DATA binary\n".encode() + body, Path("old.pcd"))
    assert points.tolist() == [(1, 2, 3), (4, 5, 6)]
    text = parse_pcd(f"{header}DATA ascii\n1 0 0 0 0 2 3\n\n4 0 0 0 0 5 6\n".encode(), Path("old.pcd"))
    assert equal(text, points)


@given(st.binary(max_size=2000) | st.lists(st.sampled_from([b"abc", b"\0" * 40, b"xyzzy"])).map(b"".join))
def test_lzf_restores_everything(data: bytes) -> None:
    assert decompress(compress(data), len(data)) == data


def test_lzf_makes_long_repetitions_short() -> None:
    assert len(compress(b"\0" * 10_000)) < 200


@given(st.binary(max_size=60), st.integers(0, 300))
def test_no_bytes_upset_the_decompression(data: bytes, size: int) -> None:
    with suppress(ValueError):
        assert len(decompress(data, size)) == size


COMPRESSED = "binary_compressed"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", r"no line 'DATA' ends the header"),
        ("\x7fELF" * 100_000, r"no line 'DATA' ends the header"),
        (pcd(10**12, "binary"), r"ends at byte \d+, after 0 points of 12 bytes; the header promises 10{12}$"),
        (pcd(10**12, body="1 2 3\n"), r":11: has 1 points; the header promises 10{12}$"),
        (pcd(10**30), r":6: WIDTH is '10{29}'; valid is a whole number from 0 to"),
        (pcd(-3), r":6: WIDTH is '-3'; valid is a whole number"),
        (pcd(2, body="1 2 3\n4 5\n"), r":12: is '4 5'; valid are numbers for x, y, z$"),
        (pcd(2, body="1 2 3\n4 5 6 7\n"), r":12: is '4 5 6 7'; valid are numbers for x, y, z$"),
        (pcd(2, body="1 2 3\n"), r":11: has 1 points; the header promises 2$"),
        (pcd(2, "zip"), r":10: DATA is 'zip'; valid are ascii, binary, binary_compressed$"),
        (pcd(2, COMPRESSED), r"ends at byte \d+, before the lengths"),
        (pcd(2, COMPRESSED, "\0\0\1\0\0\0\0\0"), r"ends at byte \d+; the compressed data end at byte \d+$"),
        (pcd(2, COMPRESSED, "\0\0\0\0\1\0\0\0"), r"byte \d+ is 1; 2 points of 12 bytes are 24 bytes$"),
        (
            pcd(10**6, COMPRESSED, "\1\0\0\0\0\x1b\xb7\0\0"),
            r"12000000; 1 compressed bytes become at most 88$",
        ),
        (pcd(2, COMPRESSED, "\1\0\0\0\x18\0\0\0\1"), r"end at byte 1, in the middle of a step"),
        (pcd(2, COMPRESSED, "\2\0\0\0\x18\0\0\0\0?"), r"become 1 bytes instead of 24, counted from byte \d+"),
        (pcd(1, SIZE="4 4"), r":3: SIZE has 2; valid is 3 values, one for each of FIELDS$"),
        (pcd(1, SIZE="4 4 3"), r":3: SIZE of 'z' is '3'; valid for F are 4, 8$"),
        (pcd(1, TYPE="F F S"), r":4: TYPE of 'z' is 'S'; valid are I, U, F$"),
        (pcd(1, COUNT="1 1 99999999"), r":5: COUNT of 'z' is '99999999'; valid is a whole number from 1 to"),
        (pcd(1, FIELDS="x y y"), r":2: FIELDS has 'y' twice$"),
        (pcd(1, FIELDS=""), r"the header has no line FIELDS$"),
        (pcd(4, HEIGHT="3"), r":9: POINTS is 4; WIDTH 4 times HEIGHT 3 is 12$"),
        (pcd(4, HIGHT="3"), r":10: 'HIGHT' is no line of a PCD header; did you mean 'HEIGHT'"),
    ],
)
def test_a_pcd_file_that_lies_is_refused_in_one_sentence(content: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "bad.pcd").write_bytes(content.encode("latin-1"))
    with pytest.raises(CloudError, match=said) as caught:
        read_cloud(tmp_path / "bad.pcd")
    (problem,) = caught.value.problems
    assert str(problem).startswith(f"{tmp_path}/bad.pcd")
    assert "\n" not in str(problem)


PLY = "ply\nformat {kind} 1.0\nelement vertex {n}\nproperty float x\nend_header\n"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("obj\n", r":1: is not 'ply'"),
        ("ply\nformat ascii 1.0\n", r"no line 'end_header' ends the header"),
        (
            PLY.format(kind="binary_little_endian", n=10**12),
            r"after 0 points of 4 bytes; the header promises 10{12}$",
        ),
        (PLY.format(kind="ascii", n=2) + "1\nx\n", r":7: is 'x'; valid are numbers for x$"),
        (PLY.format(kind="utf8", n=2), r":2: the format is 'utf8 1.0'; valid are ascii 1.0, "),
        (PLY.format(kind="ascii", n="many"), r":3: the number of 'vertex' is 'many'"),
        (PLY.format(kind="ascii", n=0).replace("vertex", "point"), r"the header has no 'element vertex'"),
        (
            PLY.format(kind="ascii", n=1).replace("float", "fload"),
            r":4: 'fload' is no type; did you mean 'float'",
        ),
        (PLY.format(kind="ascii", n=1).replace("float", "list uchar float"), r":4: 'vertex' has a list"),
    ],
)
def test_a_ply_file_that_lies_is_refused_in_one_sentence(content: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "bad.ply").write_text(content)
    with pytest.raises(CloudError, match=said):
        read_cloud(tmp_path / "bad.ply")


@given(st.integers(0, 2106), st.integers(0, 255), st.sampled_from(ENCODINGS))
def test_a_damaged_file_is_read_or_refused(at: int, byte: int, encoding: Any) -> None:
    content = bytearray(pcd_of(golden(), encoding))
    content[at % len(content)] = byte
    for damaged in (bytes(content), bytes(content[:at])):
        with suppress(CloudError):
            parse_pcd(damaged, Path("damaged.pcd"))


def test_what_a_format_lacks_is_told(tmp_path: Path) -> None:
    points = mixed()
    with pytest.raises(
        CloudError, match=r"the ending '.xyz' is no format of clouds; valid are .pcd, .ply, .las"
    ):
        write_cloud(tmp_path / "cloud.xyz", points)
    with pytest.raises(CloudError, match=r"PLY has no type for the field 'd' of uint64"):
        ply_of(points[["x", "d"]], "binary")
    with pytest.raises(CloudError, match=r"PLY has no encoding 'binary_compressed'"):
        ply_of(points[["x"]], "binary_compressed")
    write_cloud(tmp_path / "one.pcd", make_points([(1, 2, 3)]))
    with pytest.raises(CloudError, match=r"no such file; did you mean .*one.pcd"):
        read_cloud(tmp_path / "ome.pcd")


def test_a_las_file_is_read_by_others_and_read_back(tmp_path: Path) -> None:
    """laspy alone says what is in the file; a point that was not measured is not."""
    laspy = pytest.importorskip("laspy")
    points = np.zeros(4, [(name, "<f4") for name in ("x", "y", "z", "rgb", "intensity")] + [("ring", "<u2")])
    points["x"], points["y"], points["z"] = (1.25, np.nan, -3.5, 7), 2, (0, 1, 2, 3.0625)
    points["intensity"], points["ring"] = (1.4, 2, -5, 1e9), (0, 1, 2, 15)
    points["rgb"] = np.full(4, 0x102030, np.uint32).view(np.float32)
    write_cloud(tmp_path / "hall.las", points)
    theirs = laspy.read(tmp_path / "hall.las")
    assert theirs.x == pytest.approx([1.25, -3.5, 7])
    assert list(theirs.intensity) == [1, 0, 65535]
    assert list(theirs.blue) == [0x3030] * 3
    again = read_cloud(tmp_path / "hall.las")
    assert again["z"] == pytest.approx([0, 2, 3.0625])
    assert list(again["ring"]) == [0, 2, 15]
    assert [list(row[:3]) for row in channels(again["rgb"])] == [[0x10, 0x20, 0x30]] * 3


def test_surveyors_coordinates_keep_their_millimetres_in_las(tmp_path: Path) -> None:
    pytest.importorskip("laspy")
    points = np.zeros(2, [(name, "<f8") for name in "xyz"])
    points["x"] = 500_000.1234, 500_001.4321
    write_cloud(tmp_path / "site.las", points)
    assert read_cloud(tmp_path / "site.las")["x"] == pytest.approx(points["x"], abs=1e-4, rel=0)
    points["x"] = 0, 1e6
    with pytest.raises(CloudError, match="LAS holds points within 214748 m of each other; x spans more"):
        write_cloud(tmp_path / "site.las", points)


def test_a_las_file_that_lies_is_refused_in_one_sentence(tmp_path: Path) -> None:
    pytest.importorskip("laspy")
    path = tmp_path / "bad.las"
    write_cloud(path, make_points([(1, 2, 3), (4, 5, 6)]))
    whole = path.read_bytes()
    for content, said in (
        (b"", r"'LASF'"),
        (whole[:100], r"ends after 100 bytes"),
        (whole[:-1], r"the header promises \d+ bytes, but \d+ are there"),
        (whole[:100] + b"\xff" * 4 + whole[104:], r"promises \d+ bytes or more, but"),
        (whole[:247] + (10**12).to_bytes(8, "little") + whole[255:], r"promises \d+ bytes, but"),
        (whole[:104] + b"\x3f" + whole[105:], r"cannot be read as LAS"),
    ):
        path.write_bytes(content)
        with pytest.raises(CloudError, match=said):
            read_cloud(path)
