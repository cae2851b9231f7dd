"""`/controller_server`, as in Nav2."""
