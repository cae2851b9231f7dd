"""Robots by the clock on the wall: a stand-in for hardware, mirror, divergence, guard, calibration, futures."""
