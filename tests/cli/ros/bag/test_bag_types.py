"""`twin bag record` beside a node whose message type only that node knows."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from tests.cli.ros.conftest import ROOT
from tests.processes import wait_for
from twin.bridge.bags.reader import BagReader

GRAPH = "topic_graph.py"


def test_a_type_that_only_its_publisher_knows_is_in_the_bag(endpoint: str, tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    command = ["bag", "record", "/robot/gps", "/chatter", "-o", str(bag), "--connect", endpoint]
    with subprocess.Popen(
        [sys.executable, "-m", "twin.cli", *command],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    ) as process:
        wait_for(lambda: any(file.stat().st_size > 4000 for file in bag.glob("*.mcap")))
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=120)
    assert "definition" not in errors
    with BagReader(bag) as reader:
        assert reader.topics["/robot/gps"].definition == "string name\nfloat64 x\nfloat64[2] position\n"
    # Another reader decodes it, with nothing but the bag.
    with (bag / "bag_0.mcap").open("rb") as file:
        decoded = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages(
            ["/robot/gps"]
        )
        assert {(m.name, m.x, tuple(m.position)) for _, _, _, m in decoded} == {("gps", 1.5, (3.0, 4.0))}
