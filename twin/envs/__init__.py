"""Gymnasium environments: vectors of small worlds at the speed of physics, and any scenario as one."""
