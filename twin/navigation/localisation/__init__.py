"""Where a robot is on a map that it has."""
