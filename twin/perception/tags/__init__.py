"""Square tags with numbers, AprilTag's and ArUco's: what they look like, and where they are in an image."""
