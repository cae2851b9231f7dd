"""Who may move a robot: its emergency stop, and what is said of it."""
