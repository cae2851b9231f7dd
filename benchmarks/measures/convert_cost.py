"""What a conversion costs, as a ratio to MuJoCo's own compilation of the result; `make bench` prints it.

CPU time of one process after the imports: reading the file, `convert`, and one compilation of the
finished model. The absolute figures are of this machine at this moment, the ratios hold on a noisy one.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from tests.oracles.installed import example_robots
from twin.convert import convert
from twin.convert.export import export
from twin.models import load
from twin.models.mesh.meshes import _read

REPEATS = 3


def forty_links(folder: Path) -> Path:
    """Write an arm of 40 links with primitive shapes."""
    inertial = "<inertial><mass value='1'/><inertia ixx='0.01' iyy='0.01' izz='0.01'/></inertial>"
    shape = "<origin xyz='0 0 0.05'/><geometry><cylinder radius='0.02' length='0.08'/></geometry>"
    link = f"<link name='l{{0}}'>{inertial}<visual>{shape}</visual><collision>{shape}</collision></link>"
    joint = (
        "<joint name='j{0}' type='revolute'><origin xyz='0 0 0.1'/><parent link='l{1}'/><child link='l{0}'/>"
        "<axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='9' velocity='1'/></joint>"
    )
    parts = [link.format(number) for number in range(40)]
    parts += [joint.format(number, number - 1) for number in range(1, 40)]
    file = folder / "forty_links.urdf"
    file.write_text(f"<robot name='arm'>{''.join(parts)}</robot>", encoding="utf-8")
    return file


def cost(action: Callable[[], object]) -> float:
    """Return the least CPU time of some repetitions [s]."""
    times = []
    for _ in range(REPEATS):
        _read.cache_clear()  # as in a fresh process
        start = time.process_time()
        action()
        times.append(time.process_time() - start)
    return min(times)


def main() -> None:
    """Print one line for each robot."""
    wanted = ("panda.urdf", "ur5_robot.urdf", "g1_29dof_rev_1_0.urdf", "tiago_no_hand.urdf")
    print(f"{'robot':<24}{'links':>6}{'read + convert':>16}{'twin convert':>14}{'MuJoCo':>10}{'ratio':>8}")
    with tempfile.TemporaryDirectory() as folder:
        files = [forty_links(Path(folder)), *(file for file in example_robots() if file.name in wanted)]
        for file in files:
            description = load(file)
            spec = convert(description).spec
            compiled = cost(lambda spec=spec: spec.copy().compile())  # type: ignore[misc]
            converted = cost(lambda file=file: convert(load(file)))  # type: ignore[misc]
            exported = cost(lambda file=file: export(load(file), Path(folder) / "out"))  # type: ignore[misc]
            print(
                f"{file.stem:<24}{len(description.links):>6}{converted:>14.3f} s{exported:>12.3f} s"
                f"{compiled:>8.3f} s{converted / compiled:>8.1f}"
            )


if __name__ == "__main__":
    main()
