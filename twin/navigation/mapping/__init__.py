"""Simultaneous localisation and mapping from lidar scans: matching, pose graph, loop closing, map."""
