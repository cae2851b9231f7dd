"""What a user's own agent, reward or channel does wrong becomes one sentence with its line."""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from twin.errors import GymError, Problem, TwinError


@contextmanager
def blamed(kind: type, doing: str) -> Iterator[None]:
    """Turn an exception of a class's code into a sentence; what ships is not asked: its faults are ours.

    Args:
        kind: The class.
        doing: What is asked of it, such as `act`.

    Raises:
        GymError: Its code fails.
    """
    try:
        yield
    except Exception as error:
        if isinstance(error, TwinError) or kind.__module__.startswith("twin."):
            raise
        last = traceback.extract_tb(error.__traceback__)[-1]
        text = f"{doing} of {kind.__name__} fails: {type(error).__name__}: {error}"
        raise GymError(Problem(text, Path(last.filename), last.lineno)) from error
