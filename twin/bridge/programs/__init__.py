"""Programs of one's own: their arguments, their nodes, their log."""
