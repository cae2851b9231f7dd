"""What my_robot brings for twin."""
