"""MuJoCo worlds: scene and robots composed, stepped, sensed."""
