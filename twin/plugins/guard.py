"""What a plugin does wrong while it runs becomes one sentence with its name and line."""

from __future__ import annotations

import math
import traceback
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from twin.errors import BridgeError, PluginError, Problem, TwinError

if TYPE_CHECKING:
    from twin.plugins.plugin import Plugin


class Guard:
    """Around every call of a plugin: an exception becomes a `PluginError`, unless it is told as it is."""

    __slots__ = ("_plugin",)

    def __init__(self, plugin: Plugin[object]) -> None:
        self._plugin = plugin

    def __enter__(self) -> None:
        """Begin a call."""

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End it; what ships is not guarded: its faults are bugs of ours."""
        if error is None:
            return
        told = is_told(error) or self._plugin.ships
        if isinstance(error, Exception | SystemExit) and not told:
            raise blame(self._plugin, error) from error


def is_told(error: BaseException | None) -> bool:
    """Whether an error tells a user where he is wrong; those of the bus do not: whatever calls it may be."""
    return isinstance(error, TwinError) and not isinstance(error, BridgeError)


def blame(plugin: Plugin[object], error: BaseException) -> PluginError:
    """Return the error as one sentence, at the last line of the plugin's own code that was running."""
    what = f"{plugin.title} fails: {type(error).__name__}"
    if isinstance(error, SyntaxError) and error.filename:
        return PluginError(Problem(f"{what}: {error.msg}", Path(error.filename), error.lineno))
    text = " ".join(str(error).split())
    file, line = plugin.place.file, plugin.place.line
    for _, file, line, _ in _own_frames(plugin, error):  # noqa: B007  (the innermost one)
        pass
    return PluginError(Problem(f"{what}: {text}" if text else what, file, line))


def depth_of(plugin: Plugin[object], error: BaseException) -> tuple[int, int]:
    """Return how deep in the calls that an exception ended the plugin's files were, and its class; 0: not."""
    frames, file = list(_own_frames(plugin, error)), plugin.place.file
    within = f"{plugin.place.attribute}."
    inside = (depth for depth, at, _, name in frames if at == file and name.startswith(within))
    return max((depth for depth, *_ in frames), default=0), max(inside, default=0)


def _own_frames(plugin: Plugin[object], error: BaseException) -> Iterator[tuple[int, Path, int, str]]:
    """Yield depth, file, line and function of the plugin's code, outermost first.

    Of a package, all modules count; of a file, also what it calls of its neighbours.
    """
    file = plugin.place.file
    if file is None:
        return
    mine = file.resolve()
    package, entered = mine.parents[plugin.place.depth - 1] if plugin.place.depth else None, False
    for depth, (frame, line) in enumerate(traceback.walk_tb(error.__traceback__), 1):
        at = Path(frame.f_code.co_filename).resolve()
        entered |= at == mine
        if at == mine or package in at.parents or (entered and at.parent == mine.parent):
            yield depth, (file if at == mine else at), line, frame.f_code.co_qualname


def require_finite(plugin: Plugin[object], what: str, values: Iterable[float]) -> None:
    """Refuse numbers of a plugin that are none.

    Raises:
        PluginError: one is NaN or infinite.
    """
    numbers = [float(value) for value in values]
    if not all(map(math.isfinite, numbers)):
        shown = ", ".join(f"{value:g}" for value in numbers[:6])
        raise plugin.error(f"returns {what} of ({shown}); it must be finite")
