"""Driving a robot by hand, from a terminal: keys, a gamepad, and what becomes of them."""
