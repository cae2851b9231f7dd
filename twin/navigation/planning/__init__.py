"""Global planners: from a costmap and two poses to a path."""
