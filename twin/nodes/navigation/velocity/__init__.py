"""The nodes between a controller's command and the wheels."""
