"""What became of every element of a robot file."""
