"""What WarehouseNav shows, asks and pays for."""

import math

import numpy as np
import pytest

from twin.envs.randomisation import NONE, Episode
from twin.envs.warehouse_nav import Aisles, WarehouseNavConfig, WarehouseNavEnv
from twin.errors import GymError
from twin.geometry import Pose2
from twin.warehouse import arena as arenas
from twin.warehouse.arena_file import covered
from twin.warehouse.footprint import Rectangle

CONFIG = WarehouseNavConfig(
    randomisation=NONE, localisation_bias=(0.0, 0.0), localisation_noise=(0.0, 0.0), boxes=(), walkers=()
)


@pytest.fixture(scope="module")
def warehouse():
    return WarehouseNavEnv(config=CONFIG)


def test_the_way_around_a_rack_is_seen_and_paid_for(warehouse):
    # rack_c is between the two; its east end is nearer
    observation, info = warehouse.reset(seed=0, options={"start": (1.0, -4.9, 0.0), "goal": (1.0, -1.6)})
    distance, cosine, sine, ahead, ahead_cosine, ahead_sine = observation[:6]
    assert distance == pytest.approx(3.3, abs=0.01) == info["distance"]
    assert (cosine, sine) == pytest.approx((0.0, 1.0), abs=1e-3)
    assert ahead == pytest.approx(1.6, abs=0.3)
    assert abs(math.degrees(math.atan2(ahead_sine, ahead_cosine))) < 50.0
    paid = [warehouse.step(np.array([0.8, 0.0]))[1] for _ in range(15)]
    assert sum(paid) > 0.3  # although the goal is farther away than before
    assert warehouse.navigation.distances()[0] > 3.3


def test_goals_starts_and_boxes_have_room():
    config = WarehouseNavConfig()
    aisles, arena = Aisles(config), arenas.load("warehouse")
    file = arena.file
    solids = [
        covered(entry)
        for group in (file.racks, file.pallets, file.pillars, file.obstacles)
        for entry in group.values()
    ]
    solids += [covered(zone.table) for zone in file.zones.values() if zone.table]
    placed = 0
    for seed in range(60):
        layout = aisles.layout(Episode(seed, 0))
        assert math.dist(layout.start[:2], layout.goal) >= config.least_distance
        boxes = [pose for pose in layout.placed if pose]
        placed += len(boxes)
        places = [layout.start[:2], layout.goal, *(box[:2] for box in boxes)]
        for place in places:
            assert arena.hall.contains([place])
            room = Rectangle(Pose2(*place, 0.0), 0.6, 0.6)  # within the circle that is kept free
            for solid in solids:
                assert not solid.contains([place])
                assert not any(room.contains([corner]) for corner in solid.corners)
        for i, box in enumerate(boxes):
            for other in places[: 2 + i]:
                assert math.dist(box[:2], other) >= config.gap - 1e-9
    assert placed > 0.9 * 60 * len(config.boxes)


def test_walkers_are_seen_and_the_belief_has_an_error():
    """With the same seed, walkers are where they were; a robot that stands before one sees it."""
    warehouse = WarehouseNavEnv(config=WarehouseNavConfig(randomisation=NONE, boxes=()))
    warehouse.reset(seed=4)
    x, y = warehouse.navigation.simulations.mocap_pos[0, 0, :2]
    observation, _ = warehouse.reset(
        seed=4, options={"start": (x, y + 1.5, -math.pi / 2.0), "goal": (0.0, 2.2)}
    )
    ranges = observation[10:]
    assert min(ranges[17:19]) == pytest.approx(1.5 - 0.2 - 0.41, abs=0.1)
    errors = []
    for _ in range(150):
        observation, info = warehouse.reset()
        errors.append(observation[0] - info["distance"])
    rms = math.hypot(*errors) / math.sqrt(len(errors))
    assert 0.025 < rms < 0.04  # a localisation's: 3 cm that stay for an episode, and 1 cm of a step


def test_scenery_that_a_robot_meets_is_in_the_model_and_the_rest_in_pictures_only():
    aisles = Aisles(CONFIG)
    simulated = {static.name: static.shapes for static in aisles.scene.statics}
    drawn = {static.name: static.shapes for static in aisles.looks.statics}
    assert simulated.keys() < drawn.keys()
    assert {"walls", "rack_a", "pallet_1", "pillar_west", "charger", "unloading_table"} <= simulated.keys()
    assert not any(name.startswith(("stock", "tote")) for name in simulated)
    assert 20 <= sum(map(len, simulated.values())) <= 40


def test_an_arena_without_room_is_told():
    with pytest.raises(
        GymError, match=r"robot_radius is 9 m; valid: less, as then no place of arena 'warehouse'"
    ):
        Aisles(WarehouseNavConfig(robot_radius=9.0))
    with pytest.raises(GymError, match=r"least_distance is 40 m; valid: less"):
        Aisles(WarehouseNavConfig(least_distance=40.0)).layout(Episode(0, 0))
