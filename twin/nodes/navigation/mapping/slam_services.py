"""The services of `/slam_toolbox`: save, serialize, deserialize, pause, reset."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from twin.bridge.msgs import new
from twin.bridge.srvs import DeserializePoseGraph, PauseSlam, ResetSlam, SaveSlamMap, SerializePoseGraph
from twin.errors import MapError
from twin.geometry import Pose2
from twin.navigation.mapping.config import Mode

if TYPE_CHECKING:
    from twin.nodes.navigation.mapping.slam_toolbox import SlamToolboxNode

_DEFAULT_MAP = "map"


class SlamServices:
    """Serves them for one node; types and results are slam_toolbox's. Names of files are the caller's."""

    def __init__(self, owner: SlamToolboxNode) -> None:
        self._owner = owner
        node = owner.node
        for service_type, name, callback in (
            (SaveSlamMap, "save_map", self._on_save),
            (SerializePoseGraph, "serialize_map", self._on_serialize),
            (DeserializePoseGraph, "deserialize_map", self._on_deserialize),
            (PauseSlam, "pause_new_measurements", self._on_pause),
            (ResetSlam, "reset", self._on_reset),
        ):
            node.create_service(service_type, f"slam_toolbox/{name}", callback)

    def _on_save(self, request: Any) -> Any:
        """Write `<name>.yaml` and `<name>.pgm`, as map_saver does with `-f <name>`."""
        grid = self._owner.fresh_map()
        if grid is None:
            return new(SaveSlamMap.Response, result=SaveSlamMap.Response.RESULT_NO_MAP_RECEIEVD)
        path = Path(f"{request.name.data or _DEFAULT_MAP}.yaml")
        try:
            grid.save(path)
        except MapError as fault:
            self._say(str(fault))
            return new(SaveSlamMap.Response, result=SaveSlamMap.Response.RESULT_UNDEFINED_FAILURE)
        return new(SaveSlamMap.Response)

    def _on_serialize(self, request: Any) -> Any:
        try:
            self._owner.slam.save(Path(request.filename))
        except (OSError, MapError) as fault:
            self._say(f"serialize_map: the pose graph is not written: {fault}")
            failed = SerializePoseGraph.Response.RESULT_FAILED_TO_WRITE_FILE
            return new(SerializePoseGraph.Response, result=failed)
        return new(SerializePoseGraph.Response)

    def _on_deserialize(self, request: Any) -> Any:
        kind, at = DeserializePoseGraph.Request, request.initial_pose
        pose = Pose2(at.x, at.y, at.theta)
        if request.match_type == kind.UNSET:
            self._say("deserialize_map refused: match_type is not set")
            return new(DeserializePoseGraph.Response)
        first = request.match_type == kind.START_AT_FIRST_NODE
        mode: Mode = "localization" if request.match_type == kind.LOCALIZE_AT_POSE else "mapping"
        try:
            self._owner.load(Path(request.filename), mode, None if first else pose)
        except (MapError, OSError) as fault:
            self._say(f"deserialize_map refused: {fault}")
        return new(DeserializePoseGraph.Response)

    def _on_pause(self, _request: Any) -> Any:
        self._owner.paused = not self._owner.paused
        self._owner.node.get_logger().info(
            "scans are left unread" if self._owner.paused else "scans are read"
        )
        return new(PauseSlam.Response, status=True)

    def _on_reset(self, request: Any) -> Any:
        self._owner.reset()
        if request.pause_new_measurements:
            self._owner.paused = True
        return new(ResetSlam.Response)

    def _say(self, text: str) -> None:
        self._owner.node.get_logger().error(text)
