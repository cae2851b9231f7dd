"""Commands about many runs: sweeps, reports, differences, the smallest failure, known-bad stacks."""
