"""Frontier exploration: where to drive so that an unknown place becomes known."""
