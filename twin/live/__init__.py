"""Robots by the clock on the wall: stand-in for hardware, mirror, divergence, guard, calibration, futures."""
