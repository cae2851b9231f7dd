"""The names that `import twin` offers."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import twin

HEAVY = (
    "numpy",
    "mujoco",
    "zenoh",
    "pydantic",
    "rosbags",
    "scipy",
    "rerun",
    "yaml",
    "twin.api",
    "twin.models",
)


def test_nothing_heavy_is_loaded_until_a_name_is_used() -> None:
    code = (
        "import sys; before = set(sys.modules); import twin; dir(twin)\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules])\n"
        "print(sorted(set(sys.modules) - before))\n"
        "twin.Pose2; print('numpy' in sys.modules, 'mujoco' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-S", "-c", code], capture_output=True, text=True, check=False,
                          env={"PYTHONPATH": str(Path(twin.__file__).parents[1])})  # fmt: skip
    assert done.stdout.splitlines()[:2] == ["[]", "['twin']"], done.stderr


@pytest.mark.parametrize("name", twin.__all__)
def test_every_name_is_there(name: str) -> None:
    assert getattr(twin, name) is getattr(twin, name)
    assert name in dir(twin)


def test_type_checkers_see_the_same_names() -> None:
    tree = ast.parse(Path(twin.__file__).read_text("utf-8"))
    imported = [
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("twin.")
        for alias in node.names
    ]
    assert sorted(imported) == sorted(twin.__all__) == twin.__all__


def test_an_unknown_name_is_none() -> None:
    with pytest.raises(AttributeError, match="module 'twin' has no attribute 'load_robots'"):
        twin.load_robots  # noqa: B018
