"""Bags: topics on disk as ROS 2 writes them (MCAP, SQLite), and back onto a bus."""
