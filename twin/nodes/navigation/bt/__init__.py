"""What missions are made of: py_trees nodes that call actions and services."""
