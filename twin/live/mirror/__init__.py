"""A virtual robot that is kept with a physical one, and what is known of how well."""
