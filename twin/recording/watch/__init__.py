"""Any ROS 2 graph on a screen: `twin watch`."""
