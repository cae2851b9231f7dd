"""What stands between a robot and whoever commands it, on the robot's own computer."""
