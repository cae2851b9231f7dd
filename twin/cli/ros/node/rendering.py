"""Pictures of Graphviz text, made by Graphviz itself."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from twin.errors import RecordingError


def check_dot(output: Path) -> None:
    """Refuse to draw where Graphviz is missing.

    Raises:
        RecordingError: there is no `dot`.
    """
    if shutil.which("dot") is None:
        raise RecordingError(
            f"--output {output}: an .svg is drawn by dot, of the package graphviz, which is not installed; "
            "valid without it: .gv, .mmd"
        )


def svg(graphviz: str) -> str:
    """Return the drawing.

    Raises:
        RecordingError: `dot` cannot draw it.
    """
    done = subprocess.run(["dot", "-Tsvg"], input=graphviz, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RecordingError(f"dot cannot draw the graph: {' '.join(done.stderr.split())}")
    return done.stdout
