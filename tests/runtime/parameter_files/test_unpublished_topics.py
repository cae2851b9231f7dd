"""Scans that nodes of a robot await and nobody publishes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from twin.runtime.run import Run
from twin.scenario.schema import Scenario

SCENARIO = """
name: unheard
duration: 1 s
robots: [{model: diff_bot, localisation: {type: slam, params_file: FILE}}]
checks: [{odometry_drift: {max: 1 m}}]
"""


def test_a_scan_that_nobody_publishes_is_told_with_those_that_there_are(
    scenario: Callable[[str], Scenario], make_run: Callable[..., Run], tmp_path: Path
) -> None:
    file = tmp_path / "slam.yaml"

    def told(topic: str) -> list[str]:
        said: list[str] = []
        file.write_text(f"slam_toolbox: {{ros__parameters: {{scan_topic: {topic}, max_laser_range: 9.0}}}}")
        make_run(
            scenario(SCENARIO.replace("FILE", str(file))),
            taps=[lambda sample: said.append(sample.message.msg) if sample.topic == "/rosout" else None],
        )
        return [sentence for sentence in said if "nobody publishes" in sentence]

    assert told("/sensors/lidar2d_0/scan") == [
        "nobody publishes /sensors/lidar2d_0/scan, awaited by /slam_toolbox; of "
        "sensor_msgs/msg/LaserScan there is /scan; name one of these, or give a lidar this topic"
    ]
    assert told("/scan") == []
