"""Commands with the words of `ros2`, for any ROS graph over rmw_zenoh."""
