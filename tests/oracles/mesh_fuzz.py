"""Mesh files broken, flooded and blown up at random, but the same way each time.

`python -m tests.oracles.mesh_fuzz --count N --seed S` is a long run. Every batch is a process of its
own, whose largest memory is told.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np

from twin.convert.export import export
from twin.convert.geoms import _content
from twin.convert.inspection import inspect_file
from twin.geometry import Array
from twin.models.mesh.hulls import _hull_of
from twin.models.mesh.mesh_formats import write_msh, write_stl
from twin.models.mesh.meshes import _read

SLOWEST_S = 5.0
MOST_MEMORY_MB = 500
BATCH = 50
LINK = "<instance_node url='#n{}'/>"
NAMES = ("m.obj", "m.stl", "a.stl", "m.dae", "m.msh")
NASTY = (
    *(b"", b"-1", b"0", b"nan", b"-inf", b"1e308", b"1e400", b"1e-320", b"99999999999999999999", b"0x1"),
    *(b"1_0", b"9" * 5000, b"0." + b"3" * 100_000, b"a" * 100_000, b"\0", b"\xff\xfe", "🤖".encode()),
)
FLOODS = (
    *(b" ", b"\n", b"\t", b"\r", b"\r\n", b" \n", b"\\\n", b"\0", b"1 ", b"9", b"0.1 ", b"/", b"#\n", b"x"),
    *(b"v ", b"v\n", b"v 0 0 1\n", b"f 1\n", b"f 1 2 3\n", b" 1/2/3", b"vn 0 0 1\n", b"vertex "),
    *(b"vertex\n", b"vertex 0 0 1\n", b"endfacet ", b"solid ", b"endsolid", b"facet normal 0 0 1\n"),
    *(b"<a>", b"<a/>", b"<p>0</p>", b"<!---->", b"<?a?>", b"&#49;", b"&amp;", b"<![CDATA[1]]>", b" a=''"),
    *(b"<rotate>0 0 1 9</rotate>", b"<node>", b"<instance_geometry url='#g'/>", b"<x:y/>", b"<triangles/>"),
    b"<node><instance_node url='#n0'/></node>",
)


def surface(rng: np.random.Generator) -> tuple[Array, Array]:
    """Return points, shape (n, 3), and triangles of something simple that hulls find hard or easy."""
    n = int(rng.integers(4, [40, 400, 4000][int(rng.integers(3))]))
    angle = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), rng.integers(0, 2, n)], axis=1)
    ball = rng.normal(size=(n, 3))
    points = (
        ring,
        ball,
        ball / np.linalg.norm(ball, axis=1, keepdims=True),
        np.round(rng.random((n, 3)) * 3.0),
        np.column_stack([rng.random((n, 2)), rng.random(n) * 10.0 ** -rng.integers(0, 12)]),
        np.column_stack([angle, angle**2, angle**3]),
    )[int(rng.integers(6))]
    start = np.arange(n - 2)
    return points, np.stack([start, start + 1, start + 2], axis=1)


def _dae(points: Array, faces: Array, rng: np.random.Generator) -> bytes:
    count = int(10.0 ** rng.uniform(0.0, 4.5)) if rng.random() < 0.5 else 1
    instance, input_ = "<instance_geometry url='#g'/>", "<input semantic='VERTEX' source='#v' offset='0'/>"
    corners, deep = " ".join(map(str, faces.ravel())), int(rng.integers(1, 60))
    bomb = "".join(f"<node id='n{i}'>{LINK.format(i + 1) * 2}</node>" for i in range(deep))
    nodes = (
        f"<node id='n0'>{instance}</node>",
        f"<node id='n0'>{instance * count}</node>",
        f"<node><translate>1 0 0</translate>{instance}</node>" * count,
        f"{bomb}<node id='n{deep}'>{instance}</node>",
        "<node id='n0'>" + "<node>" * count + instance + "</node>" * count + "</node>",
        f"<node id='n0'><instance_node url='#n0'/>{instance}</node>",
        "<node id='n0'>" + "<rotate>0 0 1 5</rotate>" * count + f"{instance}</node>",
    )[int(rng.integers(7))]
    primitive = (
        f"<triangles>{input_}<p>{corners}</p></triangles>",
        f"<triangles>{input_}<p>0 1 2</p></triangles>" * count,
        f"<polylist>{input_}<vcount>{'3 ' * len(faces)}</vcount><p>{corners}</p></polylist>",
        f"<polygons>{input_}{'<p>0 1 2</p>' * count}</polygons>",
        f"<tristrips>{input_}<p>{corners}</p></tristrips>",
        f"<polylist>{input_}<vcount>{'0 ' * count} {len(faces) * 3}</vcount><p>{corners}</p></polylist>",
    )[int(rng.integers(6))]
    unused = "0 " * (count * 30) if rng.random() < 0.2 else ""
    stride, said = (3, len(points)) if rng.random() < 0.8 else (int(rng.integers(-1, 2**40)), 10**18)
    return f"""<?xml version="1.0"?><COLLADA><library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="a">{" ".join(f"{x:.6g}" for x in points.ravel())} {unused}</float_array>
<technique_common><accessor source="#a" count="{said}" stride="{stride}"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
{primitive}</mesh></geometry>
</library_geometries><library_visual_scenes><visual_scene id="s">{nodes}</visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>""".encode()


def _ascii_stl(points: Array, faces: Array) -> bytes:
    facets = (
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {x:g} {y:g} {z:g}\n" for x, y, z in points[face])
        + "endloop\nendfacet\n"
        for face in faces
    )
    return f"solid s\n{''.join(facets)}endsolid s\n".encode()


def hostile(seed: int) -> tuple[str, bytes]:
    """Return a file's name and content, always the same for a seed; up to some megabytes."""
    rng = np.random.Generator(np.random.Philox(seed))
    name = NAMES[int(rng.integers(len(NAMES)))]
    points, faces = surface(rng)
    if name == "m.dae":
        content = _dae(points, faces, rng)
    elif name == "m.obj":
        content = "".join(
            [f"v {x:g} {y:g} {z:g}\n" for x, y, z in points] + [f"f {a} {b} {c}\n" for a, b, c in faces + 1]
        ).encode()
    elif name == "a.stl":
        content = _ascii_stl(points, faces)
    else:
        content = write_stl(points, faces) if name == "m.stl" else write_msh(points, faces)
    for _ in range(int(rng.integers(0, 4))):
        content = _changed(content, rng)
    return name, content


def _changed(content: bytes, rng: np.random.Generator) -> bytes:
    if not content:
        return content
    place, length = int(rng.integers(len(content))), int(10.0 ** rng.uniform(0.0, 4.0))
    cut = (
        max(content.rfind(b"\n", 0, place), content.rfind(b">", 0, place)) + 1
        if rng.random() < 0.7
        else place
    )
    kind = int(rng.integers(9))
    if kind <= 2:
        flood = FLOODS[int(rng.integers(len(FLOODS)))]
        times = int(10.0 ** rng.uniform(1.0, 6.3)) // len(flood)
        return content[:cut] + flood * times + content[cut:]
    if kind == 3:
        return content[:place] + bytes([int(rng.integers(256))]) + content[place + 1 :]
    if kind == 4:
        return content[:place] if rng.random() < 0.5 else content[:place] + content[place + length :]
    if kind == 5:
        return content[:cut] + content[place : place + length] * int(rng.integers(1, 200)) + content[cut:]
    if kind == 6:
        return content.replace(b"\n", [b"\r\n", b"\r", b" ", b"\\\n", b"\n\n"][int(rng.integers(5))])
    if kind == 7:
        bom = content.decode("latin-1").encode(["utf-16", "utf-16-le", "utf-8-sig"][int(rng.integers(3))])
        return (
            bom if rng.random() < 0.3 else bytes(np.roll(np.frombuffer(content, np.uint8), length).tobytes())
        )
    words = content.split(b" ", 64)
    words[int(rng.integers(len(words)))] = NASTY[int(rng.integers(len(NASTY)))]
    return b" ".join(words)


def endure(seed: int, folder: Path) -> tuple[str, float]:
    """Check and convert a robot of such a mesh as the commands do; return the outcome and what it took [s].

    Raises:
        AssertionError: It took too long.
        Exception: Whatever escapes.
    """
    name, content = hostile(seed)
    (folder / name).write_bytes(content)
    shape = f'<geometry><mesh filename="{name}"/></geometry>'
    robot = folder / "r.urdf"
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    robot.write_text(
        f'<robot name="r"><link name="a"><inertial><mass value="1"/>{inertia}</inertial>'
        f"<visual>{shape}</visual><collision>{shape}</collision></link></robot>"
    )
    start = time.process_time()
    found = inspect_file(robot)
    faults = [fault for fault in found.diagnostics if fault.severity == "error"]
    if not faults and found.description is not None:
        export(found.description, folder / "out")
    took_s = time.process_time() - start
    assert took_s < SLOWEST_S, f"took {took_s:.1f} s"
    assert all(len(fault.message) < 400 for fault in faults), "an endless sentence"
    return faults[0].code if faults else "accepted", took_s


def run(seeds: range) -> tuple[Counter[str], float, int]:
    """Endure many; return how often each outcome came about, the longest time [s] and its seed.

    Raises:
        AssertionError: Naming the seed.
    """
    outcomes: Counter[str] = Counter()
    slowest = (0.0, 0)
    for seed in seeds:
        for cache in (_read, _hull_of, _content):  # what a process keeps of one robot is not what all need
            cache.cache_clear()
        mujoco.mj_clearCache(mujoco.mj_getCache())
        with tempfile.TemporaryDirectory() as folder:
            try:
                outcome, took_s = endure(seed, Path(folder))
            except Exception as error:
                raise AssertionError(f"seed {seed}: {type(error).__name__}: {error}") from error
        outcomes[outcome] += 1
        slowest = max(slowest, (took_s, seed))
    return outcomes, *slowest


def main(say: Callable[[str], object]) -> int:
    """Run many seeds in batches; return how many batches failed."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--here", action="store_true", help="one batch, in this process")
    options = parser.parse_args()
    end = options.seed + options.count
    if options.here:
        outcomes, took_s, seed = run(range(options.seed, end))
        memory_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
        assert memory_mb < MOST_MEMORY_MB, f"took {memory_mb} MB"
        say(f"{took_s:.2f} s at most (seed {seed}), {memory_mb} MB; {dict(outcomes)}")
        return 0
    failed = 0
    for first in range(options.seed, end, BATCH):
        arguments = ["--here", "--seed", str(first), "--count", str(min(BATCH, end - first))]
        done = subprocess.run(
            [sys.executable, "-X", "faulthandler", "-m", __spec__.name, *arguments],
            capture_output=True,
            text=True,
            check=False,
        )
        failed += done.returncode != 0
        last = (done.stderr if done.returncode else done.stdout).strip().splitlines()[-1:]
        say(f"seeds from {first}: {''.join(last)}")
    return failed


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main(_say))
