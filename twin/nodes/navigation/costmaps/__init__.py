"""A costmap as a node: its sources, its services, its messages."""
