"""Rerun recordings of runs: writing, the screen they open with, playing and reading them back."""
