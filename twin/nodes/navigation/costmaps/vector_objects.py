"""`/vector_object_server`: zones that are drawn during a run, as a filter mask (nav2_map_server)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xxhash

from twin.bridge.bus import Bus
from twin.bridge.msgs import UUID, OccupancyGrid
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import AddShapes, GetShapes, RemoveShapes
from twin.bridge.topics import Publisher
from twin.errors import MapError
from twin.geometry import Array
from twin.navigation.maps.occupancy_map import UNKNOWN, OccupancyMap
from twin.navigation.maps.zones import circle, filled, outline, with_zone
from twin.nodes.navigation.mapping.map_server import grid_msg, occupancy_map
from twin.nodes.node_parameters import declare_config

_MOST_SHAPES = 100
_MOST_CORNERS = 500


@dataclass(frozen=True, kw_only=True)
class VectorObjectServerConfig:
    """Parameters of nav2_map_server's VectorObjectServer."""

    map_topic: str = "vo_map"
    """Where the mask is published."""
    global_frame_id: str = "map"
    """In which its cells and the shapes lie."""


@dataclass
class _Shapes:
    """By their UUIDs, in the order in which they came: later ones lie over earlier ones."""

    circles: dict[bytes, Any] = field(default_factory=dict)
    polygons: dict[bytes, Any] = field(default_factory=dict)
    corners: dict[bytes, tuple[Array, int]] = field(default_factory=dict)
    """Outlines [m], and the values inside."""

    def copy(self) -> _Shapes:
        return _Shapes(dict(self.circles), dict(self.polygons), dict(self.corners))

    def remove(self, uuid: bytes) -> bool:
        self.circles.pop(uuid, None)
        self.polygons.pop(uuid, None)
        return self.corners.pop(uuid, None) is not None


class VectorObjectServerNode:
    """Closed polygons and filled circles on the cells of `map`, or of a mask that is there already.

    Until there is a shape or such a mask nothing is published. Other than Nav2's, it takes all shapes of a
    request or none, and shapes of its own frame only; the log says why.
    """

    def __init__(
        self,
        bus: Bus,
        config: VectorObjectServerConfig,
        announce: Callable[[], None],
        *,
        below: str = "",
        namespace: str = "",
    ) -> None:
        """Offer the services.

        Args:
            bus: For the node.
            config: Its parameters.
            announce: Tells costmaps of the mask; called when there is one.
            below: Topic of a mask over which the shapes are laid.
            namespace: Of the robot.
        """
        self.node = node = bus.create_node("vector_object_server", namespace)
        declare_config(node, config)
        self._config, self._announce = config, announce
        self._shapes = _Shapes()
        self._count = 0
        self._cells: OccupancyMap | None = None
        self._publisher: Publisher[OccupancyGrid] | None = None
        node.create_subscription(
            OccupancyGrid, below or "map", self._on_mask if below else self._on_map, LATCHED
        )
        node.create_service(AddShapes, "~/add_shapes", self._on_add)
        node.create_service(RemoveShapes, "~/remove_shapes", self._on_remove)
        node.create_service(GetShapes, "~/get_shapes", self._on_get)

    def _on_map(self, message: OccupancyGrid) -> None:
        try:
            self._cells = filled(occupancy_map(message), UNKNOWN)
        except MapError as error:
            self.node.get_logger().error(f"map refused: {error}")
            return
        if self._shapes.corners:
            self._publish()

    def _on_mask(self, message: OccupancyGrid) -> None:
        try:
            self._cells = occupancy_map(message)
        except MapError as error:
            self.node.get_logger().error(f"mask refused: {error}")
            return
        self._publish()

    def _on_add(self, request: Any) -> Any:
        shapes = self._shapes.copy()
        try:
            for shape in request.polygons:
                self._add(shapes, shapes.polygons, shape, self._polygon(shape))
            for shape in request.circles:
                self._add(shapes, shapes.circles, shape, self._circle(shape))
        except MapError as error:
            self.node.get_logger().error(f"zone refused: {error}")
            return AddShapes.Response(success=False)
        self._shapes = shapes
        if shapes.corners:
            self._publish()
        return AddShapes.Response(success=True)

    def _on_remove(self, request: Any) -> Any:
        shapes = _Shapes() if request.all_objects else self._shapes.copy()
        found = [shapes.remove(uuid.uuid.tobytes()) for uuid in request.uuids]
        self._shapes = shapes
        if self._publisher is not None:
            self._publish()
        return RemoveShapes.Response(success=request.all_objects or all(found))

    def _on_get(self, request: Any) -> Any:
        return GetShapes.Response([*self._shapes.circles.values()], [*self._shapes.polygons.values()])

    def _add(self, shapes: _Shapes, kind: dict[bytes, Any], shape: Any, corners: Array) -> None:
        """Take a shape in, in place of one that has its UUID.

        Raises:
            MapError: there is no map yet, no cell is inside, or there are too many shapes.
        """
        frame = self._config.global_frame_id
        if shape.header.frame_id not in ("", frame):
            raise MapError(f"it is in the frame {shape.header.frame_id[:80]!r}; valid: {frame!r}")
        if self._cells is None:
            raise MapError("there is no map yet")
        with_zone(self._cells, corners, shape.value)
        uuid = shape.uuid.uuid.tobytes()
        if not any(uuid):
            self._count += 1  # unique like a random one, and the same in the same run
            uuid = xxhash.xxh3_128_digest(f"{self.node.resolve_name('~')} {self._count}".encode())
        shapes.remove(uuid)
        kind[uuid] = replace(shape, uuid=UUID(np.frombuffer(uuid, np.uint8)))
        shapes.corners[uuid] = corners, shape.value
        if len(shapes.corners) > _MOST_SHAPES:
            raise MapError(f"there are {_MOST_SHAPES} zones, and no more")

    def _polygon(self, shape: Any) -> Array:
        if not shape.closed:
            raise MapError("an open polygon is no zone")
        if len(shape.points) > _MOST_CORNERS:
            raise MapError(f"a zone has {_MOST_CORNERS} corners at most, not {len(shape.points)}")
        return outline([(point.x, point.y) for point in shape.points])

    def _circle(self, shape: Any) -> Array:
        if not shape.fill:
            raise MapError("a circle that is not filled is no zone")
        return outline(circle(shape.center.x, shape.center.y, shape.radius))

    def _publish(self) -> None:
        assert self._cells is not None
        mask = self._cells
        for corners, value in self._shapes.corners.values():
            try:
                mask = with_zone(mask, corners, value)
            except MapError:
                continue  # of another map, beside this one
        if self._publisher is None:
            self._publisher = self.node.create_publisher(OccupancyGrid, self._config.map_topic, LATCHED)
            self._announce()
        frame = self._config.global_frame_id
        self._publisher.publish(grid_msg(mask.data, mask.resolution, mask.origin, frame, self.node.now_ns))
