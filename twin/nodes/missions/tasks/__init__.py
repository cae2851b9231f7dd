"""A robot's queue of tasks, which whoever takes part may add to."""
