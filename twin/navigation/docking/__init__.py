"""Driving up to a face that a lidar sees."""
