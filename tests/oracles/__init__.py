"""Programs of others that twin is held to."""
