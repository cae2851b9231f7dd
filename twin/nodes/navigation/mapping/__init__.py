"""The nodes that make, keep and serve maps."""
