"""Controllers: from a path and a pose to a velocity; goal and progress checkers."""
