"""Cameras as nodes: images, what lens they have, and clouds of points."""
