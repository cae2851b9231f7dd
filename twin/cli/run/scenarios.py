"""`twin scenarios`: the scenarios that have a name."""

from __future__ import annotations


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
