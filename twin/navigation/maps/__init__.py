"""Occupancy maps: in memory, and as map_server files."""
