"""What robots are told to do, as nodes."""
