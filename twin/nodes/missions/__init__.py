"""What robots are to do, as nodes."""
