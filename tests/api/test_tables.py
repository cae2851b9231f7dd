"""Bags, recordings and verdicts as Arrow tables: names, values, units; and frames of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import polars
import pyarrow as pa
import pytest

import twin
from twin.api.bag_tables import leaves, table
from twin.bridge import types
from twin.bridge.msgs import DiagnosticArray, DiagnosticStatus, JointState, KeyValue, Odometry
from twin.bridge.types.default_values import new
from twin.errors import RecordingError
from twin.scenario.checks import CheckResult
from twin.scenario.verdict import Verdict

OVERRIDES = {
    "duration": "1.5 s",
    "mission.steps.0.duration": "0.4 s",
    "checks": [{"energy": {"max": "1 kJ"}}],
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tables") / "run"
    twin.Simulation("diff_bot_figure8", overrides=OVERRIDES, out=folder, bag=True).run()
    return folder


def test_a_topic_is_a_table_with_seconds_names_and_units(folder: Path) -> None:
    bag = twin.read_bag(folder / "bag")
    odometry = bag.table("/odom")
    arrays = bag["/odom"]
    assert odometry.column_names == ["time", *(name for name in arrays if name != "time_ns")]
    np.testing.assert_array_equal(odometry["time"].to_numpy(), arrays["time_ns"] * 1e-9)
    for name in ("twist.twist.linear.x", "pose.pose.position.x", "header.stamp"):
        np.testing.assert_array_equal(odometry[name].to_numpy(), arrays[name])
    units = {field.name: (field.metadata or {}).get(b"unit", b"").decode() for field in odometry.schema}
    assert units["time"] == "s"
    assert units["header.stamp"] == "ns"
    assert units["pose.pose.position.y"] == "m"
    assert units["pose.pose.orientation.w"] == ""
    assert units["twist.twist.linear.x"] == "m/s"
    assert units["twist.twist.angular.z"] == "rad/s"
    covariance = odometry.schema.field("pose.covariance").type
    assert (covariance.list_size, covariance.value_type) == (36, pa.float64())
    flat = odometry["pose.covariance"].combine_chunks().flatten().to_numpy()
    np.testing.assert_array_equal(flat.reshape(-1, 36), arrays["pose.covariance"])


def test_some_fields_of_a_topic(folder: Path) -> None:
    bag = twin.read_bag(folder / "bag")
    chosen = bag.table("/odom", fields=["twist.twist.linear", "header.frame_id"])
    assert chosen.column_names == [
        "time",
        *(f"twist.twist.linear.{axis}" for axis in "xyz"),
        "header.frame_id",
    ]
    with pytest.raises(RecordingError, match=r"no field 'twist.linear.x'; did you mean"):
        bag.table("/odom", fields=["twist.linear.x"])
    with pytest.raises(RecordingError, match="/odm"):
        bag.table("/odm")


def test_a_table_becomes_a_frame_of_polars(folder: Path) -> None:
    frame = polars.from_arrow(twin.read_bag(folder / "bag").table("/scan"))
    assert isinstance(frame, polars.DataFrame)
    assert frame.schema["ranges"] == polars.List(polars.Float32)
    assert len(frame) > 10


def test_every_shipped_type_has_a_table() -> None:
    names = sorted(name for name in types.store.fielddefs if "/msg/" in name)
    assert len(names) > 150
    for name in names:
        messages = [new(types.get(name)) for _ in range(2)]
        found = table(name, [0, 1], messages, None)
        assert (found.num_rows, found.column_names) == (2, ["time", *(leaf.name for leaf in leaves(name))])
        assert table(name, [], [], None).schema.equals(found.schema), name


def test_messages_in_messages_are_structures_and_lists_keep_their_lengths() -> None:
    pair = KeyValue(key="a", value="1")
    status = DiagnosticStatus(level=2, name="lidar", message="", hardware_id="", values=[pair, pair])
    array = new(DiagnosticArray)
    array.status = [status]
    found = table("diagnostic_msgs/msg/DiagnosticArray", [0], [array], None)
    (row,) = found["status"].to_pylist()
    assert [(each["name"], each["level"]) for each in row] == [("lidar", 2)]
    assert row[0]["values"] == [{"key": "a", "value": "1"}] * 2
    states = [new(JointState), new(JointState)]
    states[0].name, states[0].position = ["left", "right"], np.array([1.0, 2.0])
    found = table("sensor_msgs/msg/JointState", [0, 1], states, ["name", "position"])
    assert found["name"].to_pylist() == [["left", "right"], []]
    assert found["position"].to_pylist() == [[1.0, 2.0], []]
    assert table("nav_msgs/msg/Odometry", [5], [new(Odometry)], ["header.stamp"])["time"].to_pylist() == [
        5e-9
    ]


def test_what_changes_in_a_recording_is_a_table(folder: Path) -> None:
    recording = twin.read_recording(folder / "diff_bot_figure8.rrd")
    speeds = recording.table("/velocity/diff_bot/linear/measured")
    times, values = recording.scalars("/velocity/diff_bot/linear/measured")
    np.testing.assert_array_equal(speeds["time"].to_numpy(), times * 1e-9)
    np.testing.assert_array_equal(speeds["scalars"].to_numpy(), values)
    assert speeds.schema.field("scalars").metadata == {b"unit": b"m/s"}
    poses = recording.table("/tf")
    assert poses.schema.field("translation").type.list_size == 3
    assert set(poses["parent_frame"].to_pylist()) == {"world"}
    points = recording.table("/ros/scan")["positions"]
    assert pa.types.is_list(points.type)
    with pytest.raises(RecordingError, match="nothing changes at /verdict"):
        recording.table("/verdict")
    with pytest.raises(RecordingError, match="no entity '/tff'"):
        recording.table("/tff")


def test_verdicts_of_many_runs_are_a_table(tmp_path: Path) -> None:
    far = CheckResult(
        name="driven_distance", passed=False, value=3.0, limit=2.0, unit="m", at_s=9.0, reason="far"
    )
    yes = CheckResult(name="mission_succeeded", passed=True, value=True, limit=True, at_s=1.0)
    first = Verdict(scenario="a", seed=1, checks=(yes, far), metrics={"sim_time_s": 9.5}, test="a[seed=1]")
    first.write(tmp_path / "01")
    replace(first, seed=2, checks=(yes,), test="a[seed=2]").write(tmp_path / "02")
    Verdict(scenario="b", seed=0, error="broken").write(tmp_path / "more" / "03")
    found = twin.read_runs(tmp_path)
    assert found["run"].to_pylist() == ["01", "02", "more/03"]
    assert found["verdict"].to_pylist() == ["fail", "pass", "error"]
    assert found["driven_distance.value"].to_pylist() == [3.0, None, None]
    assert found["mission_succeeded.value"].to_pylist() == [1.0, 1.0, None]
    assert found["sim_time_s"].to_pylist() == [9.5, 9.5, None]
    assert found["error"].to_pylist() == [None, None, "broken"]
    assert polars.from_arrow(found).filter(polars.col("verdict") == "fail")["test"].to_list() == ["a[seed=1]"]
    for wrong in ("[]", '{"scenario": "a", "verdict": "pass", "checks": [1], "metrics": {}}'):
        (tmp_path / "02" / "verdict.json").write_text(wrong, encoding="utf-8")
        with pytest.raises(RecordingError, match=r"verdict\.json: is no verdict of a run"):
            twin.read_runs(tmp_path)
    with pytest.raises(RecordingError, match="no run in this folder"):
        twin.read_runs(tmp_path / "absent")
