"""A robot alone in a viewer: `twin view`."""
