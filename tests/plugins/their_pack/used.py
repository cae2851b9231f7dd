"""Which classes of this package a run has used."""

USED = set()
