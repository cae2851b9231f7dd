"""The Rerun stream of a recording: opening the file, the frames it starts with, the verdict it ends with."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import rerun as rr
import rerun.blueprint as rrb

from twin.errors import RecordingError
from twin.recording.frames import WORLD, Frames
from twin.recording.sources import BodyShape

WALL_CLOCK_METRICS = frozenset({"wall_time_s", "cpu_time_s", "real_time_factor"})
"""Differ between two equal runs: kept as a property, but not in the document, so that contents can be compared."""


def open_recording(
    path: Path, application_id: str, recording_id: str, blueprint: rrb.Blueprint
) -> rr.RecordingStream:
    """Return a stream into a new file.

    Nothing in it depends on the wall clock: no `log_time`, no start time, and chunks end only when the sink flushes.

    Raises:
        RecordingError: The file cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.open("wb").close()
    except OSError as error:
        raise RecordingError(f"{path}: cannot write the recording: {error.strerror}; choose another folder") from error
    recording = rr.RecordingStream(
        application_id,
        recording_id=recording_id,
        send_properties=False,
        default_enabled=True,
        batcher_config=rr.ChunkBatcherConfig.NEVER(),
    )
    recording.set_log_tick_enabled(False)
    recording.set_log_time_enabled(False)
    recording.save(path, default_blueprint=blueprint)
    return recording


def declare_frames(
    recording: rr.RecordingStream, frames: Frames, shapes: Iterable[BodyShape], body_names: tuple[str, ...]
) -> None:
    """Log the frames that never move: maps, and static bodies that the world gives no pose for (they are at its origin)."""
    recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    namespaces = ("",) if len(frames.robots) < 2 else ("", *frames.robots)
    children = [frames.belief(namespace, "map") for namespace in namespaces]
    known = set(body_names)
    children += list(dict.fromkeys(shape.body for shape in shapes if shape.body not in known))
    for child in children:
        if child != WORLD:
            recording.log(
                f"/tf_static/{child.strip('/')}",
                rr.Transform3D(translation=(0.0, 0.0, 0.0), parent_frame=WORLD, child_frame=child),
                static=True,
            )


def log_verdict(recording: rr.RecordingStream, verdict: Mapping[str, Any]) -> None:
    """Log a verdict as properties of the recording and as a document to read."""
    plain = {key: str(verdict[key]) for key in ("scenario", "seed", "verdict", "digest") if key in verdict}
    recording.send_property("verdict", rr.AnyValues(**plain, json=json.dumps(verdict, sort_keys=True, default=str)))
    recording.log(
        "/verdict", rr.TextDocument(verdict_text(verdict), media_type="text/markdown"), static=True
    )


def verdict_text(verdict: Mapping[str, Any]) -> str:
    """Return a verdict as Markdown."""
    head = f"# {str(verdict.get('verdict', 'no verdict')).upper()}: {verdict.get('scenario', '')}"
    lines = [head, "", f"Seed {verdict.get('seed', '–')}", ""]
    checks = verdict.get("checks", ())
    if checks:
        lines += ["| check | | value | limit | at |", "|---|---|---|---|---|"]
        lines += [_check_row(check) for check in checks]
        lines.append("")
    metrics = {k: v for k, v in verdict.get("metrics", {}).items() if k not in WALL_CLOCK_METRICS}
    if metrics:
        lines += ["| metric | value |", "|---|---|"]
        lines += [f"| {name} | {_number(value)} |" for name, value in metrics.items()]
        lines.append("")
    if "digest" in verdict:
        lines.append(f"Digest `{verdict['digest']}`")
    return "\n".join(lines)


def _check_row(check: Mapping[str, Any]) -> str:
    unit = check.get("unit") or ""
    at = check.get("at_s")
    return (
        f"| {check.get('name', '')} | {'pass' if check.get('passed') else '**FAIL**'} "
        f"| {_number(check.get('value'))} {unit} | {_number(check.get('limit'))} {unit} "
        f"| {'' if at is None else f'{_number(at)} s'} |"
    )


def _number(value: object) -> str:
    if value is None:
        return "–"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
