"""The nodes of a robot, in the order in which they run."""
