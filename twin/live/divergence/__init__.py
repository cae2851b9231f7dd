"""How far a virtual robot is from the physical one that it follows, and why: pure, from stamps alone."""
