"""URDF text as data: one module for each kind of element."""
