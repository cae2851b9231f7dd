"""`twin robots`, `twin arenas`, `twin scenarios`: what has a name."""

from __future__ import annotations


def robots() -> None:
    """List the robots that ship with twin; a scenario names them as `model`."""
    from twin.cli.console import print_table
    from twin.models.catalogue import catalogue

    print_table(("model", "file"), [(name, str(path)) for name, path in catalogue().items()])


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


def scenarios() -> None:
    """List the scenarios that `twin run` knows by name: those in the folder `scenarios`, and shipped ones."""
    from twin.cli.console import print_table
    from twin.errors import ScenarioError
    from twin.scenario.catalogue import catalogue, summary

    rows = []
    for name, file in catalogue().items():
        try:
            found = summary(file)
        except ScenarioError as fault:
            rows.append((name, "", "", str(fault)))
        else:
            if found is not None:
                rows.append((name, ", ".join(found.robots), found.arena, found.description))
    print_table(("scenario", "robot", "arena", "what it shows"), rows)
