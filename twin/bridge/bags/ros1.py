"""Messages of ROS 1 to ROS 2's types and back, by rosbags' rules of migration."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from rosbags.convert.converter import is_same_wireformat, migrate_bytes
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from twin.bridge import types
from twin.bridge.bags import definitions
from twin.bridge.cdr.codec import codec
from twin.errors import BridgeError

Convert = Callable[[bytes], bytes]

_RENAMED = {"tf/msg/tfMessage": "tf2_msgs/msg/TFMessage"}


class FromRos1:
    """Converts the messages of one ROS 1 bag; types that only the bag knows become known."""

    def __init__(self) -> None:
        self._store = get_typestore(Stores.EMPTY)
        self._cache: dict[str, object] = {}

    def converter(self, typename: str, definition: str) -> tuple[str, Convert]:
        """Return the type in ROS 2 and what converts a message to CDR.

        Raises:
            BridgeError: the bag's definition cannot be parsed.
        """
        try:
            self._store.register(get_types_from_msg(definition, typename))
        except Exception as error:  # rosbags documents no single parser error
            raise BridgeError(f"the definition of {typename} cannot be parsed: {error}") from error
        target = _RENAMED.get(typename, typename)
        try:
            types.get(target)
        except BridgeError:
            definitions.learn(target, definitions.text_of(typename, self._store.fielddefs))
        return target, _conversion(self._store, types.store, typename, target, self._cache, to_ros2=True)


class ToRos1:
    """Converts ROS 2 messages to the types of Noetic, or to the like of ROS 2's where Noetic has none."""

    def __init__(self) -> None:
        self.store: Any = get_typestore(Stores.ROS1_NOETIC)
        """The types, for the writer of a ROS 1 bag."""
        self._cache: dict[str, object] = {}

    def converter(self, typename: str) -> Callable[[bytes], tuple[bytes, bool]]:
        """Return what converts a message in CDR, and says whether the bytes were all of the message.

        Raises:
            BridgeError: an unknown type.
        """
        one, convert = codec(types.get(typename)), self._of_whole(typename)

        def of_any(data: bytes) -> tuple[bytes, bool]:
            try:
                return convert(data), True
            except SerdeError:  # rosbags refuses what ROS 2's serializer leaves after a message
                _, end = one.read(data)
                return convert(data[:end]), False

        return of_any

    def _of_whole(self, typename: str) -> Convert:
        source, store = types.store, self.store
        if typename not in store.fielddefs:
            copies = get_types_from_msg(definitions.definition(typename), typename)
            store.register({name: fields for name, fields in copies.items() if name not in store.fielddefs})
        return _conversion(source, store, typename, typename, self._cache, to_ros2=False)


def _conversion(
    source: Any, store: Any, typename: str, target: str, cache: dict[str, object], *, to_ros2: bool
) -> Convert:
    """Return what converts a type of `source` to one of `store`."""
    if is_same_wireformat(source, store, typename, target):
        same = store.ros1_to_cdr if to_ros2 else source.cdr_to_ros1
        return lambda data: bytes(same(data, target))
    migrate = partial(migrate_bytes, source, store, typename, target, cache)
    return lambda data: bytes(migrate(data, src_is2=not to_ros2, dst_is2=to_ros2))
