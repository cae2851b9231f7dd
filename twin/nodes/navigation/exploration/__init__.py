"""`/explore`, as explore_lite."""
