"""A websocket for Foxglove, by its own SDK."""
