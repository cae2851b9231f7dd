"""Mesh files as triangles, and their convex hulls."""
