"""`/planner_server` and `/smoother_server`, as in Nav2."""
