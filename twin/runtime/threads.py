"""The threads of runs that are over."""

from __future__ import annotations

import gc
import sys


def end_threads() -> None:
    """End every thread that closed runs have left, so that the process can be forked: `os.fork()`.

    What stays are threads that NumPy and Rerun start when they are imported, which a fork does without, and
    Zenoh's, if there was a run that others could join.
    """
    gc.collect()  # a run is in circles; its recording ends its threads only when nobody holds it
    if "twin.recording.stream" in sys.modules:
        from twin.recording import stream

        stream.end_threads()
