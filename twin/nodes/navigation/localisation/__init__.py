"""The nodes that tell a robot where it is."""
