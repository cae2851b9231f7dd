"""Arm motion and grasping as pure classes: numbers in, numbers out."""
