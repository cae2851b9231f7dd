"""`twin arenas`: the arenas that have a name."""

from __future__ import annotations


def arenas() -> None:
    """List the arenas that ship with twin; a scenario names them as `arena`, their poses as `start`."""
    from twin.cli.console import print_table
    from twin.errors import ScenarioError
    from twin.strict_yaml import load
    from twin.warehouse.arena_file import ArenaFile
    from twin.warehouse.catalogue import catalogue

    rows = []
    for name, path in catalogue().items():
        arena = load(path, ArenaFile, error=ScenarioError)
        floor = arena.hall.rectangle
        size = f"{floor.size_x:g} x {floor.size_y:g} m"
        rows.append((name, size, ", ".join(arena.poses), ", ".join(arena.zones), str(path)))
    print_table(("arena", "hall", "poses", "zones", "file"), rows)
