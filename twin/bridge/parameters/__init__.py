"""A node's parameters, as in rclpy and rcl_interfaces."""
