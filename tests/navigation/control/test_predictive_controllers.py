"""MPPI, DWB and the rotation shim drive straight, centred, to the end, and never into anything."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from twin.geometry import Pose2, wrap_angle
from twin.navigation.control.controller import Controller
from twin.navigation.control.dwb.config import DWBConfig
from twin.navigation.control.mppi.config import (
    CRITICS,
    CostCriticConfig,
    GoalAngleCriticConfig,
    GoalCriticConfig,
    MPPIConfig,
    PathAlignCriticConfig,
    PathAngleCriticConfig,
    SpeedCriticConfig,
    TwirlingCriticConfig,
    VelocityDeadbandCriticConfig,
)
from twin.navigation.control.mppi.controller import MPPI
from twin.navigation.control.mppi.controls import SentCommands
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
from twin.navigation.control.regulated_pure_pursuit.controller import RegulatedPurePursuit
from twin.navigation.control.rotation_shim_config import RotationShimConfig
from twin.navigation.costmaps.costmap import Costmap, footprint_cost
from twin.navigation.costmaps.footprint import rectangle
from twin.navigation.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from twin.navigation.failures import InvalidPath, NoValidControl
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.navigation.planning.planner import with_headings
from twin.navigation.plugins import CONTROLLERS, create

pytestmark = pytest.mark.xdist_group("planning")

DT = 0.06
FOOTPRINT = rectangle(0.42, 0.33)
MPPI_CONFIG = MPPIConfig(
    batch_size=400,
    time_steps=40,
    model_dt=DT,
    vx_max=1.0,
    vx_min=-0.15,
    wz_max=1.5,
    ax_max=0.8,
    ax_min=-1.2,
    az_max=2.0,
    noise_time_constant=0.6,
    prune_distance=2.4,
    GoalCritic=GoalCriticConfig(cost_weight=15.0),
    GoalAngleCritic=GoalAngleCriticConfig(enabled=False),
    PathAlignCritic=PathAlignCriticConfig(offset_from_furthest=2, threshold_to_consider=0.05),
)
DWB_CONFIG = DWBConfig(
    max_vel_x=1.0, acc_lim_x=0.8, decel_lim_x=-1.2, acc_lim_theta=2.0, sim_time=1.2, prune_distance=1.2
)


def shimmed(config: MPPIConfig | DWBConfig) -> Controller:
    shim = RotationShimConfig(
        primary_controller=config,
        rotate_to_heading_angular_vel=1.2,
        max_angular_accel=1.2,
        rotate_to_goal_heading=True,
    )
    controller = create(CONTROLLERS, shim, footprint=FOOTPRINT)
    controller.set_goal_tolerance(0.05)
    return controller


@pytest.fixture(params=[MPPI_CONFIG, DWB_CONFIG], ids=["mppi", "dwb"])
def make(request: pytest.FixtureRequest) -> Callable[[], Controller]:
    return lambda: shimmed(request.param)


def hall(*boxes: tuple[float, float, float, float], padding: float = 0.0) -> Costmap:
    """8 x 4 m, walled; boxes are x0, y0, x1, y1."""
    data = np.zeros((80, 160), dtype=np.int8)
    data[:2] = data[-2:] = 100
    data[:, :2] = data[:, -2:] = 100
    for box in boxes:
        x0, y0, x1, y1 = (round(value / 0.05) for value in box)
        data[y0:y1, x0:x1] = 100
    room = OccupancyMap(data=data, resolution=0.05, origin=Pose2(0.0, 0.0, 0.0))
    polygon = tuple((float(x), float(y)) for x, y in FOOTPRINT)
    config = CostmapConfig(
        footprint=polygon, inflation_radius=0.8, cost_scaling_factor=4.0, footprint_padding=0.0
    )
    return LayeredCostmap(config=config, static_map=room).costmap


def line(x0: float, x1: float, y: float) -> np.ndarray:
    x = np.linspace(x0, x1, 1 + round(abs(x1 - x0) / 0.05))
    return with_headings(np.column_stack([x, np.full_like(x, y)]))


def drive(
    controller: Controller, start: Pose2, path: np.ndarray, costmap: Costmap | None, seconds: float = 30.0
) -> np.ndarray:
    """Return x, y, yaw, v, w until the goal is reached within 5 cm and 0.05 rad; the drive lags by 0.1 s."""
    pose, v, w, log, there = start, 0.0, 0.0, [], False
    for _ in range(round(seconds / DT)):
        there |= pose.distance(Pose2(*path[-1])) < 0.05
        if there and abs(wrap_angle(pose.yaw - path[-1, 2])) < 0.05:
            return np.array(log)
        command = controller.compute_velocity(pose, (v, w), path, costmap, DT)
        v += min(max((command[0] - v) * 0.45, -1.2 * DT), 0.8 * DT)
        w += min(max((command[1] - w) * 0.45, -3.0 * DT), 2.0 * DT)
        pose = pose @ Pose2(v * DT * np.sinc(w * DT / (2 * np.pi)), 0.0, 0.0) @ Pose2(0.0, 0.0, w * DT)
        log.append((*pose, v, w))
        assert costmap is None or footprint_cost(costmap, FOOTPRINT, pose) < 254, "it hit something"
    raise AssertionError(f"not there after {seconds} s, but at {pose}")


def test_a_straight_line_is_driven_straight_and_to_its_end(make: Callable[[], Controller]) -> None:
    log = drive(make(), Pose2(1.0, 2.0, 0.0), line(1.0, 6.5, 2.0), hall())
    assert np.abs(log[:, 1] - 2.0).max() < 0.02
    assert log[:, 3].max() > 0.9
    assert len(log) * DT < 12.0


def test_an_offset_is_steered_out_and_a_path_behind_is_turned_to(make: Callable[[], Controller]) -> None:
    log = drive(make(), Pose2(6.0, 2.3, 0.3), line(6.0, 1.5, 2.0), hall())
    assert np.abs(log[2 * len(log) // 3 :, 1] - 2.0).max() < 0.05
    assert np.hypot(log[:10, 0] - 6.0, log[:10, 1] - 2.3).max() < 0.02, "it turns in place first"


def test_the_middle_of_a_corridor_is_kept(make: Callable[[], Controller]) -> None:
    corridor = hall((2.0, 0.1, 6.0, 1.5), (2.0, 2.5, 6.0, 3.9))
    log = drive(make(), Pose2(1.0, 2.0, 0.0), line(1.0, 7.0, 2.0), corridor)
    inside = (log[:, 0] > 2.0) & (log[:, 0] < 6.0)
    assert np.abs(log[inside, 1] - 2.0).max() < 0.04


def test_mppi_drives_around_what_stands_on_the_path() -> None:
    costmap = hall((3.5, 1.9, 3.7, 2.1))
    log = drive(shimmed(MPPI_CONFIG), Pose2(1.0, 2.05, 0.0), line(1.0, 6.5, 2.0), costmap)
    assert np.abs(log[:, 1] - 2.0).max() > 0.3
    assert abs(log[-1, 1] - 2.0) < 0.05


def test_a_closed_way_is_never_driven_into(make: Callable[[], Controller]) -> None:
    costmap = hall((4.0, 0.1, 4.2, 3.9))
    controller, path, pose, v = make(), line(1.0, 6.5, 2.0), Pose2(1.0, 2.0, 0.0), 0.0
    for _ in range(200):
        try:
            v, w = controller.compute_velocity(pose, (v, 0.0), path, costmap, DT)
        except NoValidControl:
            v = w = 0.0
        pose = pose @ Pose2(v * DT, 0.0, 0.0) @ Pose2(0.0, 0.0, w * DT)
        assert footprint_cost(costmap, FOOTPRINT, pose) < 254
    assert pose.x < 4.0 - 0.21


def test_mppi_slows_down_where_it_is_narrow() -> None:
    path, corridor = line(1.0, 7.0, 2.0), hall((2.0, 0.1, 6.0, 1.65), (2.0, 2.35, 6.0, 3.9))
    slow = drive(shimmed(MPPI_CONFIG), Pose2(1.0, 2.0, 0.0), path, corridor)
    config = replace(MPPI_CONFIG, SpeedCritic=SpeedCriticConfig(enabled=False))
    fast = drive(shimmed(config), Pose2(1.0, 2.0, 0.0), path, corridor)
    speeds = [log[(log[:, 0] > 3.0) & (log[:, 0] < 5.5), 3].mean() for log in (slow, fast)]
    assert speeds[0] < 0.75 * speeds[1]


def test_the_same_inputs_give_the_same_commands_and_another_seed_others(
    make: Callable[[], Controller],
) -> None:
    runs = [drive(make(), Pose2(1.0, 2.2, 0.0), line(1.0, 4.0, 2.0), hall()) for _ in range(2)]
    assert np.array_equal(runs[0], runs[1])
    controller = make()
    drive(controller, Pose2(1.0, 2.2, 0.0), line(1.0, 4.0, 2.0), hall())
    controller.reset()
    again = drive(controller, Pose2(1.0, 2.2, 0.0), line(1.0, 4.0, 2.0), hall())
    assert np.array_equal(runs[0], again), "reset forgets everything"


def test_a_speed_limit_holds_and_is_lifted(make: Callable[[], Controller]) -> None:
    controller = make()
    controller.set_speed_limit(0.3)
    log = drive(controller, Pose2(1.0, 2.0, 0.0), line(1.0, 3.0, 2.0), hall())
    assert 0.25 < log[:, 3].max() <= 0.31
    controller.set_speed_limit(None)
    log = drive(controller, Pose2(1.0, 2.0, 0.0), line(1.0, 6.0, 2.0), hall())
    assert log[:, 3].max() > 0.8


def test_what_is_not_a_path(make: Callable[[], Controller]) -> None:
    with pytest.raises(InvalidPath):
        make().compute_velocity(Pose2(0.0, 0.0, 0.0), (0.0, 0.0), np.full((2, 3), np.nan), None, DT)


def test_the_costmap_may_be_in_another_frame_than_the_path() -> None:
    path, costmap = line(1.0, 6.0, 2.0), hall((3.5, 1.9, 3.7, 2.1))
    away = Pose2(-3.0, 5.0, 1.1)
    moved = np.column_stack([away.apply(path[:, :2]), path[:, 2] + away.yaw])
    here = Pose2(2.0, 2.05, 0.1)
    commands = []
    for pose, followed in ((here, path), (away @ here, moved)):
        controller = MPPI(config=MPPI_CONFIG, footprint=FOOTPRINT)
        commands.append(
            controller.compute_velocity(pose, (0.5, 0.0), followed, costmap, DT, costmap_pose=here)
        )
        assert controller.trajectory is not None
        assert pose.inverse().apply(controller.trajectory[:1, :2])[0] == pytest.approx([0.03, 0.0], abs=0.01)
    assert commands[0] == pytest.approx(commands[1], abs=1e-3)


def test_mppi_backs_out_along_a_path_that_says_so() -> None:
    """As Hybrid-A* plans it: backwards into the cusp, then forwards."""
    back = line(4.0, 2.5, 2.0)
    back[:, 2] = 0.0
    path = np.concatenate([back, line(2.5, 5.5, 2.0)[1:]])
    config = replace(MPPI_CONFIG, vx_min=-0.5, PathAngleCritic=PathAngleCriticConfig(mode=2))
    for controller in (
        MPPI(config=config, footprint=FOOTPRINT),
        RegulatedPurePursuit(
            config=RegulatedPurePursuitConfig(allow_reversing=True, xy_goal_tolerance=0.05),
            footprint=FOOTPRINT,
        ),
    ):
        log = drive(controller, Pose2(4.0, 2.0, 0.0), path, hall())
        assert log[:, 0].min() < 2.75
        assert np.abs(log[:, 2]).max() < 0.3, "it never turns around"
        assert log[:, 3].min() < -0.2


def test_an_ackermann_drive_never_turns_tighter_than_it_can() -> None:
    angles = np.linspace(0.0, np.pi / 2, 40)
    bend = np.column_stack([3.0 + np.sin(angles), 1.0 + 1.0 - np.cos(angles)])
    path = with_headings(np.concatenate([line(1.0, 3.0, 1.0)[:-1, :2], bend]))
    config = replace(MPPI_CONFIG, motion_model="Ackermann", min_turning_r=0.7)
    controller, pose, v, w = MPPI(config=config, footprint=FOOTPRINT), Pose2(1.0, 1.0, 0.0), 0.0, 0.0
    for _ in range(80):
        v, w = controller.compute_velocity(pose, (v, w), path, hall(), DT)
        assert abs(w) <= abs(v) / 0.7 + 1e-5
        pose = pose @ Pose2(v * DT, 0.0, 0.0) @ Pose2(0.0, 0.0, w * DT)
    assert pose.distance(Pose2(*path[-1])) < 0.6


def test_the_outline_is_checked_not_a_circle() -> None:
    """A gap wider than the robot but narrower than its circumscribed circle."""
    costmap = hall((3.0, 0.1, 3.2, 1.75), (3.0, 2.25, 3.2, 3.9))
    log = drive(shimmed(MPPI_CONFIG), Pose2(1.0, 2.0, 0.0), line(1.0, 6.0, 2.0), costmap)
    assert log[-1, 0] > 5.9
    wide = replace(MPPI_CONFIG, CostCritic=CostCriticConfig(consider_footprint=False))
    assert drive(shimmed(wide), Pose2(1.0, 2.0, 0.0), line(1.0, 2.5, 2.0), hall())[-1, 0] > 2.4


def test_where_there_is_no_room_to_turn_the_primary_controller_drives() -> None:
    path = line(2.0, 4.0, 2.0)
    for blocked in (False, True):
        costmap = hall()
        if blocked:
            costmap.costs[40:42, 45] = 254  # beside the robot: not under it, but where its corner will be
        w = shimmed(DWB_CONFIG).compute_velocity(Pose2(2.0, 2.0, -1.2), (0.0, 0.8), path, costmap, DT)
        assert (w[0] == 0.0) is not blocked


@pytest.mark.parametrize("with_shim", [False, True])
@pytest.mark.parametrize("config", [MPPI_CONFIG, DWB_CONFIG], ids=["mppi", "dwb"])
def test_who_is_carried_off_at_the_goal_drives_there_anew(
    config: MPPIConfig | DWBConfig, with_shim: bool
) -> None:
    """Localisation is put right by 40 cm while the robot turns: it is not at the goal any more."""
    if not with_shim and isinstance(config, MPPIConfig):
        config = replace(config, GoalAngleCritic=GoalAngleCriticConfig())
    controller = shimmed(config) if with_shim else create(CONTROLLERS, config, footprint=FOOTPRINT)
    controller.set_goal_tolerance(0.05)
    path = line(2.0, 4.0, 2.0)
    path[-1, 2] = 0.9
    controller.compute_velocity(Pose2(3.0, 2.0, 0.0), (0.3, 0.0), path, hall(), DT)
    for yaw in (0.0, 0.1, 0.2, 0.3):
        v, _ = controller.compute_velocity(Pose2(4.0, 2.0, yaw), (0.0, 0.0), path, hall(), DT)
        assert abs(v) < 0.15
    log = drive(controller, Pose2(3.6, 1.95, 0.35), path, hall(), seconds=20.0)
    assert np.hypot(*(log[-1, :2] - path[-1, :2])) < 0.1
    for yaw in (0.7, 0.75, 0.8) if with_shim else ():  # and once more, to where the goal lies behind it
        controller.compute_velocity(Pose2(4.0, 2.0, yaw), (0.0, 0.0), path, hall(), DT)
    if with_shim:
        drive(controller, Pose2(4.4, 2.1, 0.8), path, hall(), seconds=30.0)


def test_a_speed_limit_holds_backwards_too() -> None:
    back = line(4.0, 2.0, 2.0)
    back[:, 2] = 0.0
    controller = create(CONTROLLERS, replace(DWB_CONFIG, min_vel_x=-0.5), footprint=FOOTPRINT)
    controller.set_goal_tolerance(0.05)
    controller.set_speed_limit(0.1)
    assert drive(controller, Pose2(4.0, 2.0, 0.0), back, hall())[:, 3].min() == pytest.approx(-0.1, abs=0.01)
    controller.set_speed_limit(None)
    assert drive(controller, Pose2(4.0, 2.0, 0.0), back.copy(), hall())[:, 3].min() < -0.3


@pytest.mark.parametrize(
    ("period", "want"),
    [
        (0.05, [4, 5, 6, 7, 8, 9]),
        (0.1, [7, 7, 8, 8, 9, 9]),
        (0.075, [6, 6, 7, 8, 8, 9]),
        (0.025, [0, 0, 2, 4, 6, 8]),
    ],
)
def test_commands_under_way_are_those_of_their_time(period: float, want: list[int]) -> None:
    """The last of nine has held for one control period when the next is asked for; steps are 0.05 s."""
    sent = SentCommands(6, 0.05)
    assert not sent.latest(4).any(), "it stood before"
    for number in range(1, 10):
        sent.add((number, -number), period)
    assert sent.latest(6).tolist() == [want, [-v for v in want]]
    assert sent.latest(2).tolist() == [want[-2:], [-v for v in want[-2:]]]


def test_mppi_knows_what_is_under_way_at_another_period_than_its_models() -> None:
    config = replace(MPPI_CONFIG, model_dt=0.5 * DT, model_delay_vx=2.0 * DT)
    controller, v, speeds = MPPI(config=config, footprint=FOOTPRINT), 0.0, []
    for _ in range(5):
        v, _ = controller.compute_velocity(Pose2(1.0, 2.0, 0.0), (v, 0.0), line(1.0, 6.5, 2.0), hall(), DT)
        speeds.append(v)
    assert controller._under_way[0] == pytest.approx([speeds[-2]] * 2 + [speeds[-1]] * 2)


# critics that score only if they are listed


def listed(name: str, **critics: object) -> MPPIConfig:
    return replace(MPPI_CONFIG, critics=(*CRITICS, name), **critics)  # type: ignore[arg-type]


def first_command(config: MPPIConfig, start: Pose2, v: float) -> tuple[float, float]:
    controller = create(CONTROLLERS, config, footprint=FOOTPRINT)
    return controller.compute_velocity(start, (v, 0.0), line(1.0, 6.5, 2.0), hall(), DT)


def test_a_twirling_critic_turns_less() -> None:
    start = Pose2(1.0, 2.4, 0.0)
    plain = first_command(MPPI_CONFIG, start, 0.5)
    critic = TwirlingCriticConfig(cost_weight=60.0)
    calm = first_command(listed("TwirlingCritic", TwirlingCritic=critic), start, 0.5)
    assert abs(calm[1]) < 0.7 * abs(plain[1])
    unlisted = first_command(replace(MPPI_CONFIG, TwirlingCritic=critic), start, 0.5)
    assert unlisted == plain


def test_a_deadband_critic_avoids_speeds_that_the_drive_would_not_obey() -> None:
    corridor = hall((2.0, 0.1, 6.0, 1.65), (2.0, 2.35, 6.0, 3.9))

    def speed(config: MPPIConfig) -> float:
        controller, pose, v, w, steps = (
            create(CONTROLLERS, config, footprint=FOOTPRINT),
            Pose2(3.0, 2.0, 0.0),
            0.6,
            0.0,
            0,
        )
        while pose.x < 4.5:
            v, w = controller.compute_velocity(pose, (v, w), line(1.0, 7.0, 2.0), corridor, DT)
            pose = pose @ Pose2(v * DT, 0.0, 0.0) @ Pose2(0.0, 0.0, w * DT)
            steps += 1
            assert steps < 200
        return (pose.x - 3.0) / (steps * DT)

    critic = VelocityDeadbandCriticConfig(deadband_velocities=(0.9, 0.0, 0.0))
    obeyed = speed(listed("VelocityDeadbandCritic", VelocityDeadbandCritic=critic))
    assert speed(MPPI_CONFIG) < 0.65 < 0.8 < obeyed, "SpeedCritic's is slower"


def test_an_obstacles_critic_keeps_off_as_the_cost_critic_does() -> None:
    room, start = hall((2.0, 0.1, 5.0, 1.7)), Pose2(1.0, 2.0, 0.0)
    blind = tuple(name for name in CRITICS if name not in ("CostCritic", "SpeedCritic"))
    middle = [
        drive(shimmed(replace(MPPI_CONFIG, critics=critics)), start, line(1.0, 6.5, 2.0), room)
        for critics in (blind, (*blind, "ObstaclesCritic"))
    ]
    beside = [log[(log[:, 0] > 3.0) & (log[:, 0] < 4.0), 1].mean() for log in middle]
    assert beside[1] > beside[0] + 0.01


def test_dwb_stops_at_the_goal_before_it_turns() -> None:
    """What turns there without driving stands: it is rotating already."""
    path = line(2.0, 4.0, 2.0)
    path[-1, 2] = 1.2

    def commanded(velocity: tuple[float, float]) -> tuple[float, float]:
        controller = create(CONTROLLERS, DWB_CONFIG, footprint=FOOTPRINT)
        controller.set_goal_tolerance(0.05)
        return controller.compute_velocity(Pose2(3.98, 2.0, 0.0), velocity, path, hall(), DT)

    v, w = commanded((0.0, 0.9))
    assert v == 0.0
    assert w > 0.3
    assert abs(commanded((0.6, 0.0))[0]) < 0.6, "it brakes first"


def at_the_goal(*, to_its_heading: bool) -> tuple[Controller, tuple[float, float]]:
    shim = RotationShimConfig(primary_controller=DWB_CONFIG, rotate_to_goal_heading=to_its_heading)
    controller = create(CONTROLLERS, shim, footprint=FOOTPRINT)
    controller.set_goal_tolerance(0.1)
    path = line(2.0, 4.0, 2.0)
    path[-1, 2] = -2.0
    return controller, controller.compute_velocity(Pose2(3.95, 2.0, 0.0), (0.0, 0.0), path, hall(), DT)


def test_the_shim_turns_to_the_goals_heading_if_it_is_to() -> None:
    controller, command = at_the_goal(to_its_heading=True)
    assert command == pytest.approx((0.0, -3.2 * DT)), "by its own acceleration, the short way round"
    assert controller.carrot == pytest.approx((4.0, 2.0))
    assert controller.trajectory is None, "the primary controller does not drive"
    controller, _ = at_the_goal(to_its_heading=False)
    assert controller.trajectory is not None


def test_the_shim_turns_to_a_path_aside_and_drives_along_one_ahead() -> None:
    path = line(2.0, 4.0, 2.0)
    for yaw, turns in ((-0.6, False), (-0.79, True), (0.79, True), (0.6, False)):
        controller = create(
            CONTROLLERS, RotationShimConfig(primary_controller=DWB_CONFIG), footprint=FOOTPRINT
        )
        v, w = controller.compute_velocity(Pose2(2.0, 2.0, yaw), (0.0, 0.0), path, hall(), DT)
        assert (controller.trajectory is None) is turns
        assert (v == 0.0 and abs(w) == pytest.approx(3.2 * DT)) is turns
        assert not turns or w * yaw < 0.0


def test_what_the_primary_controller_had_in_mind_is_not_shown_while_the_shim_turns() -> None:
    controller = create(CONTROLLERS, RotationShimConfig(primary_controller=DWB_CONFIG), footprint=FOOTPRINT)
    here = Pose2(3.0, 2.0, 0.0), (0.0, 0.0)
    for path, drives in (
        (line(2.0, 4.0, 2.0), True),
        (line(4.0, 2.0, 2.0), False),
        (line(2.0, 4.0, 2.0), True),
    ):
        controller.compute_velocity(*here, path, hall(), DT)
        assert (controller.trajectory is not None) is drives
