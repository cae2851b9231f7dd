"""Behaviour-tree nodes: Nav2's control nodes on py_trees, and leaves that call actions and services."""
