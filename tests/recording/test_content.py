"""What is read back from a recording is what was put in."""

from __future__ import annotations

import json
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from twin.errors import RecordingError
from twin.geometry import xyzw_from_wxyz
from twin.recording.read_back import Recording, read
from twin.recording.shapes import rgba8
from twin.recording.sink import RerunSink
from twin.sim.world import World
from twin.warehouse.arena import load as load_arena
from twin.warehouse.arena_scene import PALETTE


@pytest.fixture(scope="session")
def content(recorded: Any) -> Recording:
    return read(recorded.path)


def test_only_simulated_time(content: Recording) -> None:
    assert content.timelines == {"sim_time"}
    assert content.recording_id == "demo"


def test_poses_of_what_moves(content: Recording, make_world: Any) -> None:
    frames = np.array(content.column("/tf", "Transform3D:child_frame").values)[:, 0]
    column = content.column("/tf", "Transform3D:translation")
    rotation = content.column("/tf", "Transform3D:quaternion").numpy()[:, 0]
    rows = np.flatnonzero(frames == "robot/base_link")
    assert column.times_ns[rows].tolist() == list(range(0, 3_000_000_001, 40_000_000))
    world = make_world()
    for row in rows[[0, 20, -1]]:
        world.time_ns = int(column.times_ns[row])
        truth = world.pose("robot/base_link")
        np.testing.assert_allclose(column.numpy()[row, 0], truth.xyz, atol=1e-6)
        np.testing.assert_allclose(rotation[row], xyzw_from_wxyz(truth.quat_wxyz), atol=1e-6)


def test_what_rests_is_kept_once(content: Recording) -> None:
    frames = [row[0] for row in content.column("/tf", "Transform3D:child_frame").values]
    assert frames.count("crate_5") == 1
    assert frames.count("crate_0") > 50  # is carried


def test_scan_points_are_in_the_lidars_frame(content: Recording, recorded: Any) -> None:
    column = content.column("/ros/scan", "Points3D:positions")
    samples = recorded.of("/scan")
    assert column.times_ns.tolist() == [sample.time_ns for sample in samples]
    scan = samples[7].message
    angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
    hit = np.isfinite(scan.ranges)
    assert 0 < hit.sum() < len(hit)
    expected = np.stack((np.cos(angles), np.sin(angles)), axis=1)[hit] * scan.ranges[hit, None]
    np.testing.assert_allclose(np.array(column.values[7])[:, :2], expected, atol=1e-5)


@pytest.mark.parametrize(("topic", "body"), [("/scan", "base_scan"), ("/tote_poses", "base_link")])
def test_what_a_body_sees_stays_where_it_was_seen(
    content: Recording, recorded: Any, make_world: Any, topic: str, body: str
) -> None:
    """Its frame moves only with its messages, and at their times, not at those of the poses."""
    frame = f"origin of {topic}"
    assert content.column(f"/ros{topic}", "CoordinateFrame:frame").values == [["world"], [frame]]
    entity = f"/tf_topics{topic}"
    column = content.column(entity, "Transform3D:translation")
    assert column.times_ns.tolist() == [sample.time_ns for sample in recorded.of(topic)]
    assert {row[0] for row in content.column(entity, "Transform3D:child_frame").values} == {frame}
    world = make_world()
    rotation = content.column(entity, "Transform3D:quaternion").numpy()[:, 0]
    for i in (0, -1):
        world.time_ns = int(column.times_ns[i])
        truth = world.pose(f"robot/{body}")
        np.testing.assert_allclose(column.numpy()[i, 0], truth.xyz, atol=1e-6)
        np.testing.assert_allclose(rotation[i], xyzw_from_wxyz(truth.quat_wxyz), atol=1e-6)


def test_everything_has_a_place_from_the_start(content: Recording) -> None:
    """Without a frame an entity is an error in every view, if it is only styled or shown later."""
    styled = ("Points3D:", "LineStrips3D:", "Arrows3D:", "GridMap:", "Boxes3D:", "Mesh3D:", "Cylinders3D:")
    drawn = [e for e in content.entities if any(c.startswith(styled) for c in content.columns[e])]
    assert {"/ros/tote_poses", "/ros/scan", "/ros/plan", "/estimate/robot"} <= set(drawn)
    for entity in drawn:
        frame = content.column(entity, "CoordinateFrame:frame")
        if len(frame.times_ns):  # else it is static
            assert (frame.times_ns[0], frame.values[0]) == (0, ["world"]), entity


@pytest.mark.parametrize("kind", ["commanded", "measured"])
def test_velocities(content: Recording, recorded: Any, kind: str) -> None:
    samples = recorded.of("/cmd_vel" if kind == "commanded" else "/odom")
    twists = [s.message if kind == "commanded" else s.message.twist.twist for s in samples]
    times, linear = content.scalars(f"/velocity/robot/linear/{kind}")
    _, angular = content.scalars(f"/velocity/robot/angular/{kind}")
    assert times.tolist() == [sample.time_ns for sample in samples]
    assert linear.tolist() == [twist.linear.x for twist in twists]
    assert angular.tolist() == [twist.angular.z for twist in twists]


def test_joints_without_wheels(content: Recording, recorded: Any) -> None:
    """The run says which joints are wheels, not their names."""
    _, lift = content.scalars("/joints/robot/lift_joint")
    assert lift.tolist() == [sample.message.position[2] for sample in recorded.of("/joint_states")]
    plotted = {entity for entity in content.entities if entity.startswith("/joints")}
    assert plotted == {"/joints/robot/lift_joint", "/joints/robot/wheel_right_joint"}


def test_joints_have_colours_of_their_own(content: Recording) -> None:
    looks = [content.columns[entity] for entity in content.entities if entity.startswith("/joints")]
    assert len({str(look["SeriesLines:colors"].values) for look in looks}) == len(looks) == 2


def test_mission_states_are_changes(content: Recording) -> None:
    column = content.column("/mission/state", "StateChange:state")
    assert column.values == [["drive to pick"], ["align"], ["grasp"]]
    assert column.times_ns.tolist() == [0, 1_500_000_000, 3_000_000_000]


def test_log_has_levels(content: Recording) -> None:
    texts = content.column("/log", "TextLog:text").values
    assert texts[0] == ["[bt_navigator] goal is 12.0 m away"]
    assert content.column("/log", "TextLog:level").values[:2] == [["WARN"], ["INFO"]]


def test_map_is_upright(content: Recording, recorded: Any) -> None:
    grid = recorded.of("/map")[0].message
    cells = np.frombuffer(bytes(content.column("/ros/map", "GridMap:data").values[0][0]), dtype=np.int8)
    south_west = cells.reshape(grid.info.height, grid.info.width)[-1, 0]  # images begin in the north-west
    assert south_west == -1 == grid.data[0]


def test_rasters_keep_their_time(content: Recording, recorded: Any) -> None:
    times = content.column("/ros/local_costmap/costmap", "GridMap:data").times_ns
    published = {sample.time_ns for sample in recorded.of("/local_costmap/costmap")}
    assert len(times) > 2
    assert set(times.tolist()) <= published


def test_updates_change_rasters(make_run: Any, tmp_path: Any) -> None:
    """Of the grid of which they are, cell by cell; one that lies outside of it is left out."""
    run = make_run(duration_s=0.5)
    costs = (np.arange(12 * 8) % 100).astype(np.int8).reshape(8, 12)
    sink = RerunSink(tmp_path / "updates.rrd")
    sink.declare(run.world)

    def update(x: int, y: int, cells: np.ndarray) -> None:
        height, width = cells.shape
        where = {"x": x, "y": y, "width": width, "height": height}
        header = SimpleNamespace(frame_id="map")
        sample = SimpleNamespace(
            topic="/global_costmap/costmap_updates",
            msgtype="map_msgs/msg/OccupancyGridUpdate",
            time_ns=run.world.time_ns,
            message=SimpleNamespace(header=header, **where, data=cells.ravel()),
        )
        sink.on_sample(sample)  # type: ignore[arg-type]

    window = np.full((2, 3), 55, np.int8)
    expected = [costs, costs.copy()]
    expected[1][5:7, 4:7] = window
    update(0, 0, window)
    sink.on_sample(run.publish("/global_costmap/costmap", run.grid(costs, "map", 0.0, 0.0)))
    for i, (x, y) in enumerate(((4, 5), (4, 5), (11, 5))):
        run.world.time_ns = (i + 1) * 20_000_000
        update(x, y, window)
    sink.close()
    column = read(tmp_path / "updates.rrd").column("/ros/global_costmap/costmap", "GridMap:data")
    assert column.times_ns.tolist() == [0, 20_000_000]
    for row, cells in zip(column.values, expected, strict=True):
        assert bytes(row[0]) == cells[::-1].tobytes()


def test_equal_rasters_and_plans_are_kept_once(make_run: Any, tmp_path: Any) -> None:
    run = make_run(duration_s=0.0)
    sink = RerunSink(tmp_path / "a.rrd")
    sink.declare(run.world)
    (samples,) = run.ticks()
    for sample in samples * 3:
        sink.on_sample(sample)
    sink.close()
    content = read(tmp_path / "a.rrd")
    assert len(content.column("/ros/map", "GridMap:data").values) == 1
    assert len(content.column("/ros/plan", "LineStrips3D:strips").values) == 1


def test_particles_and_plan(content: Recording, recorded: Any) -> None:
    cloud = recorded.of("/particle_cloud")[2].message
    first = content.column("/ros/particle_cloud", "Arrows3D:origins").values[2]
    assert len(first) == 300  # 600, at most 500 are kept, evenly spread
    kept = cloud.poses[2].position
    np.testing.assert_allclose(first[1][:2], (kept.x, kept.y), atol=1e-6)
    yaw = 2 * math.atan2(cloud.poses[2].orientation.z, cloud.poses[2].orientation.w)
    vector = content.column("/ros/particle_cloud", "Arrows3D:vectors").values[2][1]
    assert math.atan2(vector[1], vector[0]) == pytest.approx(math.remainder(yaw, 2 * math.pi), abs=1e-5)
    plan = recorded.of("/plan")[2].message
    strip = np.array(content.column("/ros/plan", "LineStrips3D:strips").values[2][0])
    assert strip.shape == (len(plan.poses), 3)
    np.testing.assert_allclose(strip[-1, 0], plan.poses[-1].pose.position.x, atol=1e-6)


def test_belief_and_its_error(content: Recording, recorded: Any) -> None:
    """The demo's localisation is off by (0.15 sin t, 0.1 cos 1.3 t) and 0.03 rad, renewed at 10 Hz."""
    times, error = content.scalars("/localisation/robot/position_error")
    fresh = (times % 100_000_000 == 0) & (times > 0)
    t = times[fresh] / 1e9
    np.testing.assert_allclose(error[fresh], np.hypot(0.15 * np.sin(t), 0.1 * np.cos(1.3 * t)), atol=1e-6)
    _, yaw = content.scalars("/localisation/robot/yaw_error")
    np.testing.assert_allclose(yaw[fresh], 0.03, atol=1e-6)
    frames = {row[0] for row in content.column("/tf_belief/robot", "Transform3D:child_frame").values}
    assert frames == {"odom", "base_footprint"}  # links are drawn where they truly are
    frames = content.column("/estimate/robot", "CoordinateFrame:frame").values
    assert frames == [["world"], ["base_footprint"]]


def test_the_truth_is_seen_beneath_the_estimate(content: Recording) -> None:
    def look(trail: str) -> tuple[float, float]:
        radius = content.column(f"/trails/robot/{trail}", "LineStrips3D:radii").values[0][0]
        strips = content.column(f"/trails/robot/{trail}", "LineStrips3D:strips").values
        return -radius, strips[0][0][0][2]  # points of the screen are negative

    for trail in ("odometry", "estimate"):
        assert look("truth")[0] > 2 * look(trail)[0]
        assert look("truth")[1] < look(trail)[1]


def test_odometry_starts_at_the_truth(content: Recording) -> None:
    truth = np.array(content.column("/trails/robot/truth", "LineStrips3D:strips").values)
    odometry = np.array(content.column("/trails/robot/odometry", "LineStrips3D:strips").values)
    np.testing.assert_allclose(odometry[0, 0, 0, :2], truth[0, 0, 0, :2], atol=1e-6)
    assert np.linalg.norm(odometry[-1, 0, -1] - truth[-1, 0, -1]) > 0.03  # and drifts
    np.testing.assert_allclose(truth[1:, 0, 0], truth[:-1, 0, 1])  # one unbroken line


def test_shapes_hang_on_their_bodies(content: Recording) -> None:
    assert content.column("/world/robot/lift", "CoordinateFrame:frame").values == [["robot/lift"]]
    half = content.column("/world/robot/base_link", "Boxes3D:half_sizes").values[0][0]
    np.testing.assert_allclose(half, (0.3, 0.225, 0.1), atol=1e-6)
    assert content.column("/world/arena/rack_0", "CoordinateFrame:frame").values == [["world"]]
    lower_cap = content.column("/world/robot/mast", "Capsules3D:translations").values[0][0]
    np.testing.assert_allclose(lower_cap, (0, 0, -0.2), atol=1e-6)


def test_verdict(content: Recording, verdict: dict[str, Any]) -> None:
    text = content.column("/verdict", "TextDocument:text").values[0][0]
    assert text.startswith("**PASS: demo**, seed 7\n")
    assert "localisation_error | **FAIL** | 0.31 m | 0.25 m |  | 2.4 s" in text
    assert "wall_time_s" not in text
    stored = content.column("/__properties/verdict", "json").values[0][0]
    assert json.loads(stored) == verdict


def test_asking_for_what_is_not_there(content: Recording) -> None:
    with pytest.raises(RecordingError, match=r"no entity '/ros/scam'.*did you mean '/ros/scan'"):
        content.column("/ros/scam", "Points3D:positions")
    with pytest.raises(RecordingError, match="no component"):
        content.column("/ros/scan", "Points2D:positions")


def test_surfaces_and_decals_have_textures(tmp_path: Any) -> None:
    """Of scenery that has a material with one, each once, tinted by the colours of its shapes."""
    scene = load_arena("warehouse").scene()
    world = World.compose(scene, [])
    sink = RerunSink(tmp_path / "looks.rrd")
    sink.declare(world)
    sink.close()
    content = read(tmp_path / "looks.rrd")
    surfaces = {entity for entity in content.entities if entity.startswith("/world/surfaces/")}
    assert surfaces == {f"/world/surfaces/{name}" for name in ("plaster", "wood", "cardboard", "board")}
    decals = {entity for entity in content.entities if entity.startswith("/world/decals/")}
    assert len(decals) == len(scene.decals) > 6
    for entity in surfaces | decals:
        told = content.columns[entity]
        assert "Mesh3D:albedo_texture_buffer" in told, entity
        corners = told["Mesh3D:vertex_positions"].values[0]
        assert len(corners) == len(told["Mesh3D:vertex_texcoords"].values[0]), entity
        assert told["CoordinateFrame:frame"].values == [["world"]], entity
    wood = content.columns["/world/surfaces/wood"]["Mesh3D:vertex_colors"].values[0]
    assert set(wood) == {int.from_bytes(rgba8(PALETTE["wood"]))}
