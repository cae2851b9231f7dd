"""`twin run --web`: the bridge beside a run."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from websockets.sync.client import connect

from tests.processes import free_endpoint, wait_for_listener

RUN = ("-m", "twin.cli", "run", "diff_bot_figure8", "--no-record", "--json")


def test_who_only_watches_changes_no_bit_of_a_run(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    port = endpoint.rpartition(":")[2]
    (tmp_path / "tokens").write_text("viewer-0123456789 viewer\n")
    words = ("--web", "--web-port", port, "--web-address", "0.0.0.0", "--web-token", tmp_path / "tokens")
    words = (*words, "--pace", "4", "--out", tmp_path / "watched")
    watched = [sys.executable, *RUN, *words]
    with subprocess.Popen(watched, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        wait_for_listener(endpoint)
        with connect(f"ws://127.0.0.1:{port}/?token=viewer-0123456789", max_size=None) as client:
            for topic in ("/odom", "/scan", "/tf", "/robot_description"):
                client.send(json.dumps({"op": "subscribe", "topic": topic}))
            heard: set[str] = set()
            while len(heard) < 4:
                heard.add(json.loads(client.recv(timeout=100.0))["topic"])
        out, errors = process.communicate(timeout=200.0)
    assert process.returncode == 0, errors
    assert "rosbridge listens on ws://0.0.0.0" in errors
    assert "waiting" not in errors
    alone = subprocess.run(
        [sys.executable, *RUN, "--out", tmp_path / "alone"], capture_output=True, text=True, check=True
    )
    assert json.loads(out)["digest"] == json.loads(alone.stdout)["digest"]
    assert not (tmp_path / "watched" / "rosbridge.jsonl").exists()  # nobody commanded


def test_a_page_for_others_needs_tokens_before_the_run_begins(tmp_path: Path) -> None:
    words = ("--web", "--web-address", "0.0.0.0", "--out", tmp_path / "run")
    done = subprocess.run([sys.executable, *RUN, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "--web-token FILE" in done.stderr
    assert not (tmp_path / "run").exists()
