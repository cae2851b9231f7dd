"""Path following by the arc to a point ahead, after Nav2."""
