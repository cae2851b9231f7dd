"""The Rerun stream of a recording: opening the file, the frames it starts with, the verdict it ends with."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

import rerun as rr
import rerun.blueprint as rrb
import rerun_bindings

from twin.errors import RecordingError
from twin.files.writing import replaced
from twin.recording.columns import Chunk, Component, send, sim_time
from twin.recording.frames import WORLD, Frames
from twin.recording.live_screen import LiveScreen
from twin.recording.whole_messages import cut_off, is_cut

Stream = TypeVar("Stream", bound=rr.RecordingStream)

WALL_CLOCK_METRICS = frozenset(
    {"wall_time_s", "cpu_time_s", "real_time_factor", "pace_losses", "pace_lost_s"}
)
"""Differ between two equal runs: kept as a property, not in the document, so that contents compare equal."""
FLUSH_TIMEOUT_S = 60
"""Longest wait for a disk that is slow."""
_STANDS_S = 10
"""So long a file that ends within a message may stand still before its writer is taken for dead [s]."""
_SPARE = 1 << 16
"""Bytes of a file that could not be written on which are given back, for the verdict of the run."""
_abandoned: list[Any] = []
"""Streams whose writer has ended."""


class UnwrittenError(RecordingError):
    """The file of a recording could not be written to its end."""


class _Shown(rr.RecordingStream):
    """A stream whose content is shown on a screen, too: what is in it is made once."""

    screen: LiveScreen
    keeps: bool
    """Whether the content goes anywhere else."""

    def log(self, *args: Any, **options: Any) -> None:
        if self.keeps:
            super().log(*args, **options)
        self.screen.put(lambda shown: shown.log(*args, **options), lasting=True)

    def set_time(self, *args: Any, **options: Any) -> None:
        if self.keeps:
            super().set_time(*args, **options)
        self.screen.put(lambda shown: shown.set_time(*args, **options), lasting=True)

    def send_chunks(self, chunks: Any) -> None:
        chunks = list(chunks)
        if self.keeps:
            super().send_chunks(chunks)
        self.screen.put(lambda shown: shown.send_chunks(chunks))

    def send_property(self, *args: Any, **options: Any) -> None:
        if self.keeps:
            super().send_property(*args, **options)

    def send_blueprint(self, *args: Any, **options: Any) -> None:
        """Keep it; who watches has turned the eyes of the screen, which stay as they are."""
        if self.keeps:
            super().send_blueprint(*args, **options)


def open_recording(
    target: Path | None,
    application_id: str,
    recording_id: str,
    blueprint: rrb.Blueprint,
    screen: LiveScreen | None = None,
) -> rr.RecordingStream:
    """Return a stream into a new file, and onto a screen.

    Nothing in it depends on the wall clock: no `log_time`, no start time; chunks end when the sink flushes.
    It has no footer, an index of all chunks: that would grow in memory for as long as a run goes on.

    Raises:
        UnwrittenError: The disk is full.
        RecordingError: The file cannot be written, or the screen is not there.
    """
    if target is not None:
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.open("wb").close()
        except OSError as error:
            raise RecordingError(
                f"{target}: cannot write the recording: {error.strerror}; choose another folder"
            ) from error
        if not _has_room(target.parent):  # for its writer Rerun would wait for ever
            target.unlink()
            raise _not_whole(target)
    if screen is None:
        recording = without_clock(rr.RecordingStream, application_id, recording_id)
    else:
        screen.open(application_id, recording_id, blueprint)
        recording = shown = without_clock(_Shown, application_id, recording_id)
        shown.screen, shown.keeps = screen, target is not None
    with handed_over(blueprint):
        if target is not None:
            recording.save(target, default_blueprint=blueprint, write_footer=False)
    return recording


def without_clock(kind: type[Stream], application_id: str, recording_id: str) -> Stream:
    """Return a stream without a start time, in which nothing has a time of its own."""
    recording = kind(
        application_id,
        recording_id=recording_id,
        send_properties=False,
        default_enabled=True,
        batcher_config=rr.ChunkBatcherConfig.NEVER(),
    )
    recording.set_log_tick_enabled(False)
    recording.set_log_time_enabled(False)
    return recording


@contextmanager
def handed_over(blueprint: rrb.Blueprint) -> Iterator[None]:
    """End the stream by which Rerun hands a blueprint over in the block: it would stay, with two threads."""
    streams: list[rr.RecordingStream] = []
    log = blueprint._log_to_stream

    def noted(stream: rr.RecordingStream) -> None:
        streams.append(stream)
        log(stream)

    blueprint._log_to_stream = noted  # type: ignore[method-assign]
    try:
        yield
    finally:
        del blueprint._log_to_stream
        for stream in streams:
            stream.disconnect()


def end_threads() -> None:
    """End the threads of recordings that nobody holds any more."""
    for _ in range(2):  # the first look finds what the second ends
        rerun_bindings.flush_and_cleanup_orphaned_recordings()


def begin_flush(recording: rr.RecordingStream) -> None:
    """Have everything so far written, meanwhile; what goes wrong is told by the next `flush`."""
    with suppress(RuntimeError):
        recording.flush(timeout_sec=0.0)


def flush(recording: rr.RecordingStream, target: Path | None) -> None:
    """Wait until everything so far is in the file.

    A full disk ends Rerun's writer, for which its flush then may wait for ever. What can be read of the file
    stays.

    Raises:
        UnwrittenError: It could not be written.
    """
    if target is None:
        return
    if _is_abandoned(recording):
        raise _not_whole(target)
    sizes: list[int] = []
    for _ in range(FLUSH_TIMEOUT_S):
        try:
            recording.flush(timeout_sec=1.0)
            return
        except RuntimeError as fault:
            if "timed out" not in str(fault) or not _has_room(target.parent):
                break
            sizes.append(_stopped_at(target))
            if sizes[-1] >= 0 and sizes[-_STANDS_S:] == [sizes[-1]] * _STANDS_S:
                break
    with suppress(OSError):  # the disk is gone
        cut_off(target, _SPARE)
    # When it is collected, or the process ends, Rerun would wait for that writer, too.
    _abandoned.append(recording.inner)
    rr.unregister_shutdown()
    raise _not_whole(target)


def _stopped_at(target: Path) -> int:
    """Return the size of a file that ends within a message [bytes]; -1: of one that does not."""
    with suppress(OSError):
        return target.stat().st_size if is_cut(target) else -1
    return -1


def _is_abandoned(recording: rr.RecordingStream) -> bool:
    return any(recording.inner is each for each in _abandoned)


def drop_file(recording: rr.RecordingStream) -> None:
    """Go on with the screen alone, if there is one."""
    if isinstance(recording, _Shown):
        recording.keeps = False


def _has_room(folder: Path) -> bool:
    try:
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(bytes(1 << 16))
    except OSError:
        return False
    return True


def end_recording(recording: rr.RecordingStream, target: Path | None) -> None:
    """See that all is in the file, and close it.

    A stream whose writer has ended is left open: to close it would wait for that writer, for ever.

    Raises:
        UnwrittenError: The file is not whole.
    """
    flush(recording, target)
    if not _is_abandoned(recording):
        recording.disconnect()


@contextmanager
def whole_recording(path: Path) -> Iterator[Path]:
    """Yield where to write a recording that takes the place of `path` only once it is whole.

    Raises:
        RecordingError: The file cannot be written.
    """
    try:
        with replaced(path) as new:
            yield new
    except (OSError, RuntimeError, RecordingError) as fault:
        raise _not_whole(path) from fault


def _not_whole(path: Path) -> UnwrittenError:
    return UnwrittenError(f"{path}: the recording could not be written to its end; is the disk full?")


def declare_up(recording: rr.RecordingStream) -> None:
    """Log which way is up."""
    recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)


def declare_frames(recording: rr.RecordingStream, frames: Frames) -> None:
    """Log which way is up, and that every robot's map is where the world is."""
    declare_up(recording)
    for namespace in ("",) if len(frames.robots) < 2 else ("", *frames.robots):
        child = frames.belief(namespace, "map")
        recording.log(
            f"/tf_static/{child.strip('/')}",
            rr.Transform3D(translation=(0.0, 0.0, 0.0), parent_frame=WORLD, child_frame=child),
            static=True,
        )


def log_verdict(recording: rr.RecordingStream, verdict: Mapping[str, Any]) -> None:
    """Log a verdict as properties of the recording and as a document to read."""
    plain = {key: str(verdict[key]) for key in ("scenario", "seed", "verdict", "digest") if key in verdict}
    whole = json.dumps(verdict, sort_keys=True, default=str)
    recording.send_property("verdict", rr.AnyValues(drop_untyped_nones=True, **plain, json=whole))
    send(recording, _worst_moments(verdict.get("checks", ())))
    recording.log("/verdict", rr.TextDocument(verdict_text(verdict), media_type="text/markdown"), static=True)


def _worst_moments(checks: Iterable[Mapping[str, Any]]) -> Iterator[Chunk]:
    """Yield lines of the log where each check came closest to being otherwise: what it was then."""
    known = sorted((c for c in checks if c.get("worst_s") is not None), key=lambda check: check["worst_s"])
    if not known:
        return
    times = [round(check["worst_s"] * 1e9) for check in known]
    levels = ["INFO" if check["passed"] else "ERROR" for check in known]
    text, level = (Component(rr.TextLog, name) for name in ("text", "level"))
    yield "/log/checks", sim_time(times), (text.column(list(map(_moment, known))), level.column(levels))


def _moment(check: Mapping[str, Any]) -> str:
    unit = check.get("unit") or ""
    said = check.get("reason") or f"worst moment, {_number(check.get('value'))} {unit}".rstrip()
    margin = "" if check.get("margin") is None else f", margin {_number(check['margin'])} {unit}".rstrip()
    return f"{check.get('name', '')}: {said}{margin}"


def verdict_text(verdict: Mapping[str, Any]) -> str:
    """Return a verdict as Markdown."""
    word = str(verdict.get("verdict", "no verdict")).upper()
    lines = [f"**{word}: {verdict.get('scenario', '')}**, seed {verdict.get('seed', '–')}", ""]
    checks = verdict.get("checks", ())
    if checks:
        lines += ["| check | | value | limit | margin | at |", "|---|---|---|---|---|---|"]
        lines += [_check_row(check) for check in checks]
        lines.append("")
    if faults := verdict.get("faults", ()):
        lines += ["| fault | | from | effect |", "|---|---|---|---|"]
        lines += [_fault_row(fault) for fault in faults]
        lines.append("")
    metrics = {k: v for k, v in verdict.get("metrics", {}).items() if k not in WALL_CLOCK_METRICS}
    if metrics:
        lines += ["| metric | value |", "|---|---|"]
        lines += [f"| {name} | {_number(value)} |" for name, value in metrics.items()]
        lines.append("")
    if "digest" in verdict:
        lines.append(f"Digest `{verdict['digest']}`")
    return "\n".join(lines)


def _fault_row(fault: Mapping[str, Any]) -> str:
    at = "" if fault["at_s"] is None else f"{fault['at_s']:.2f} s"
    return f"| {fault['name']} | {fault['outcome'].replace('_', ' ')} | {at} | {fault['effect']} |"


def _check_row(check: Mapping[str, Any]) -> str:
    unit = check.get("unit") or ""
    at = check.get("at_s") if check.get("worst_s") is None else check["worst_s"]
    margin = "" if check.get("margin") is None else f"{_number(check['margin'])} {unit}"
    name = str(check.get("name", "")).replace("|", "\\|")
    return (
        f"| {name} | {'pass' if check.get('passed') else '**FAIL**'} "
        f"| {_number(check.get('value'))} {unit} | {_number(check.get('limit'))} {unit} | {margin} "
        f"| {'' if at is None else f'{_number(at)} s'} |"
    )


def _number(value: object) -> str:
    if value is None:
        return "–"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
