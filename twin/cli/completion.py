"""What a shell completes names to; files come from the shell itself."""

from __future__ import annotations


def scenarios() -> list[str]:
    """Return the names of scenarios."""
    from twin.scenario.catalogue import catalogue

    return list(catalogue())


def robots() -> list[str]:
    """Return the names of robots."""
    from twin.models.catalogue import catalogue

    return list(catalogue())


def arenas() -> list[str]:
    """Return the names of arenas."""
    from twin.warehouse.catalogue import catalogue

    return list(catalogue())


def examples() -> list[str]:
    """Return the names of example programs."""
    from twin.cli.examples import catalogue

    return list(catalogue())
