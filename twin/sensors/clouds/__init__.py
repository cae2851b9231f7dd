"""What lidars that make clouds have in common."""
