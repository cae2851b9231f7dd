from __future__ import annotations

from twin.bridge import types
from twin.bridge.types import type_store
from twin.bridge.types.type_hash import known_hashes, rihs01_of


def test_every_hash_of_the_table_is_that_of_its_definition() -> None:
    wrong = [
        name
        for name, told in known_hashes().items()
        if rihs01_of(name, types.definitions(name)) != told or types.rihs01(name) != told
    ]
    assert wrong == []


def test_every_type_that_comes_with_the_package_is_in_the_table() -> None:
    shipped = {*type_store._shipped_names(), *type_store._in_library}
    parts = ("_SendGoal", "_GetResult", "_FeedbackMessage")
    travelling = {name + part for name in shipped if "/action/" in name for part in parts}
    assert known_hashes().keys() == shipped | travelling


def test_a_type_that_is_in_no_table_has_a_hash() -> None:
    types.register("test_msgs/msg/InNoTable", "geometry_msgs/Vector3 value\nint32 count\n")
    assert types.rihs01("test_msgs/InNoTable") == rihs01_of(
        "test_msgs/msg/InNoTable", types.definitions("test_msgs/msg/InNoTable")
    )
