"""Nav2's parameter files."""
