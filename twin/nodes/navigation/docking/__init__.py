"""`/docking_server`, as in Nav2's opennav_docking."""
