"""Cameras in a compiled world: what they see, drawn by MuJoCo without a display."""
