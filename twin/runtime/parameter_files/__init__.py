"""ROS 2 parameter files as people have them: what the nodes here take of each, and what they lack."""
