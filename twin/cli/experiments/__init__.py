"""Commands about many runs, and what there is to say of one."""
