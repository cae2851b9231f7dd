"""Nav2's range sensor layer: the cones of sonars and infrared sensors as probabilities of cells."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Pose2
from twin.navigation._jit import jit
from twin.navigation.costmaps.costmap import FREE_SPACE, LETHAL_OBSTACLE, NO_INFORMATION, triple
from twin.navigation.costmaps.costmap_config import RangeSensorConfig
from twin.navigation.costmaps.kernels import Cells, Triple
from twin.navigation.costmaps.layer import SensedLayer
from twin.navigation.costmaps.window import NOTHING, Window


class RangeSensorLayer(SensedLayer):
    """Bayes' rule per cell, with the sensor model of nav2's RangeSensorLayer (van der Poel's sonar layer).

    A cell is 254 times the probability that it is occupied.
    """

    unseen = int(0.5 * LETHAL_OBSTACLE)

    def __init__(self, shape: tuple[int, int], config: RangeSensorConfig | None = None) -> None:
        super().__init__(shape)
        self.config = config or RangeSensorConfig()
        mark, clear = (
            int(t * LETHAL_OBSTACLE) for t in (self.config.mark_threshold, self.config.clear_threshold)
        )
        self._table: NDArray[np.uint8] = np.full(256, NO_INFORMATION, dtype=np.uint8)
        self._table[:clear] = FREE_SPACE
        self._table[mark + 1 :] = LETHAL_OBSTACLE
        self._table[255] = NO_INFORMATION

    def add(
        self, sensor: Pose2, distance: float, limits: tuple[float, float], field_of_view: float, frame: Triple
    ) -> Window:
        """Take a reading; return the window that may have changed.

        Args:
            sensor: Pose in the costmap's frame; the cone opens along its x.
            distance: What was measured [m]; of a sensor whose limits are equal, -inf is "something there" and
                inf is "nothing there" (sensor_msgs/Range).
            limits: Least and greatest range [m]; readings outside are no readings.
            field_of_view: Full angle of the cone [rad]; 0: a ray. With a negative or infinite one there is
                no reading.
            frame: Origin x, y and resolution of the grid [m].
        """
        reading = self._reading(distance, *limits)
        if reading is None or not (math.isfinite(reading[0]) and 0.0 <= field_of_view < math.inf):
            return NOTHING
        distance, clearing = reading
        # No centre of a cell lies on a ray: it reaches a cell to either side where it ends.
        half = 0.5 * field_of_view or math.atan2(frame[2], distance)
        # As nav2, a fifth further than the reading, so that the far side of the object is weighed, too.
        columns, rows = _triangle(sensor, 1.2 * distance, half, frame)
        window = Window(min(columns), min(rows), max(columns) + 1, max(rows) + 1).clipped(self.cells.shape)
        if window.empty:
            return NOTHING
        model = (float(distance), half, float(self.config.phi))
        triangle, inflate = np.array([columns, rows], dtype=np.int64), float(self.config.inflate_cone)
        _update_cone(self.cells, triple(sensor), model, clearing, inflate, triangle, window, frame)
        return window

    def _reading(self, distance: float, least: float, greatest: float) -> tuple[float, bool] | None:
        """Return a reading's distance [m], and whether it tells that nothing is there; None: no reading."""
        if least == greatest:
            if not math.isinf(distance) or (distance > 0.0 and not self.config.clear_on_max_reading):
                return None
            return least, distance > 0.0
        if not least <= distance <= greatest:
            return None
        return distance, distance >= greatest and self.config.clear_on_max_reading

    def costs(self, window: Window) -> Cells:
        """Return the costs of a window's cells: lethal, free, or unknown where the readings do not decide."""
        costs: Cells = self._table[self.cells[window.slices]]
        return costs


def _triangle(sensor: Pose2, reach: float, half: float, frame: Triple) -> tuple[list[int], list[int]]:
    """Return columns and rows of the corners of a cone of half an angle [rad], the sensor first."""
    xs = [sensor.x, *(sensor.x + reach * math.cos(sensor.yaw + side * half) for side in (-1, 1))]
    ys = [sensor.y, *(sensor.y + reach * math.sin(sensor.yaw + side * half) for side in (-1, 1))]
    columns = [math.floor((x - frame[0]) / frame[2]) for x in xs]
    rows = [math.floor((y - frame[1]) / frame[2]) for y in ys]
    return columns, rows


@jit
def sensor_model(distance: float, phi: float, theta: float, half: float, phi_v: float, cell: float) -> float:
    """Return the probability of an occupied cell at (phi [m], theta [rad]) after a reading of `distance` [m].

    Source: nav2_costmap_2d/plugins/range_sensor_layer.cpp, sensor_model.
    """
    gamma = 0.0 if abs(theta) > half else 1.0 - (theta / half) ** 2
    weight = (1.0 - (1.0 + math.tanh(2.0 * (phi - phi_v))) / 2.0) * gamma
    spread = cell * distance
    if 0.0 <= phi < distance - 2.0 * spread:
        return (1.0 - weight) * 0.5
    if phi < distance - spread:
        return weight * 0.5 * ((phi - (distance - 2.0 * spread)) / spread) ** 2 + (1.0 - weight) * 0.5
    if phi < distance + spread:
        return weight * (0.5 - 0.5 * ((distance - phi) / spread) ** 2) + 0.5
    return 0.5


@jit
def _update_cone(
    cells: Cells,
    sensor: Triple,
    model: Triple,
    clearing: bool,
    inflate_cone: float,
    triangle: NDArray[np.int64],
    window: Window,
    frame: Triple,
) -> None:
    """Apply Bayes' rule to the cells of a window.

    `model` is what was measured [m], half of the cone's angle [rad] and the distance that counts half [m];
    `triangle` has the cone's corners: columns, then rows.
    """
    (x, y, yaw), (distance, half, phi_v), (origin_x, origin_y, resolution) = sensor, model, frame
    tx, ty = (
        math.floor((x + distance * math.cos(yaw) - origin_x) / resolution),
        math.floor((y + distance * math.sin(yaw) - origin_y) / resolution),
    )
    if 0 <= tx < cells.shape[1] and 0 <= ty < cells.shape[0]:
        cells[ty, tx] = 233
    (ox, ax, bx), (oy, ay, by) = triangle[0], triangle[1]
    doubled = abs((bx - ax) * (oy - ay) - (by - ay) * (ox - ax))
    slack = -inflate_cone * doubled / 2.0
    sense = 1 if (bx - ax) * (oy - ay) - (by - ay) * (ox - ax) >= 0 else -1
    margin = math.sqrt(0.5) * resolution  # from a cell's centre to its corners
    for v in range(window.y0, window.y1):
        for u in range(window.x0, window.x1):
            if inflate_cone < 1.0:
                w0 = sense * ((bx - ax) * (v - ay) - (by - ay) * (u - ax))
                w1 = sense * ((ox - bx) * (v - by) - (oy - by) * (u - bx))
                w2 = sense * ((ax - ox) * (v - oy) - (ay - oy) * (u - ox))
                if w0 < slack or w1 < slack or w2 < slack:
                    continue
            dx, dy = origin_x + (u + 0.5) * resolution - x, origin_y + (v + 0.5) * resolution - y
            theta = math.atan2(dy, dx) - yaw
            theta = math.atan2(math.sin(theta), math.cos(theta))
            phi, sensed = math.hypot(dx, dy), 0.0
            if not clearing:
                sensed = sensor_model(distance, phi, theta, half, phi_v, resolution)
            elif phi > distance + margin or (phi > margin and abs(theta) > half + math.asin(margin / phi)):
                continue  # nav2 frees the whole bounding box here, also what the cone does not touch
            prior = cells[v, u] / 254.0
            occupied, free = sensed * prior, (1.0 - sensed) * (1.0 - prior)
            if occupied + free > 0.0:
                cells[v, u] = int(occupied / (occupied + free) * 254.0)
