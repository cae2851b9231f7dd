"""What my_robot is: the robot, its arena, its checks."""
