"""Commands about many runs: what differs between two, the smallest failure, known-bad stacks."""
