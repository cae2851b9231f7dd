"""The bus: Zenoh session, nodes, ROS 2 types and codecs, actions, tf."""
