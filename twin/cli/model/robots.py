"""`twin robots`: the catalogue of models."""

from __future__ import annotations


def robots() -> None:
    """List the robots that ship with twin; a scenario names them as `model`."""
    from twin.cli.console import print_table
    from twin.models.catalogue import catalogue

    print_table(("model", "file"), [(name, str(path)) for name, path in catalogue().items()])
