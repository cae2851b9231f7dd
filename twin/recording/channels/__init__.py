"""What topics look like in a recording."""
