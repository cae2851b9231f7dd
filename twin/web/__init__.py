"""Ways from a browser, and from web clients, into a ROS graph."""
