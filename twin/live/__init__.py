"""Robots by the clock on the wall: one that stands in for a physical one."""
