"""What clients without a websocket are given: pictures of cameras, and tiles of maps."""
