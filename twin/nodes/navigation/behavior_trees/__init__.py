"""Nav2's behaviour tree nodes that need ROS: actions, services, topics, transforms (nav2_behavior_tree)."""
