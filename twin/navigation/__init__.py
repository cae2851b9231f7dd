"""Navigation without middleware: maps, costmaps, planning, control, localisation, recovery, docking.

Everything here is numpy in, numpy out, and runs on a physical robot as it does in the twin. Paths are arrays
of shape (n, 3): x [m], y [m], yaw [rad]. Velocities are (v [m/s], w [rad/s]) of the base frame (REP-103).
"""
