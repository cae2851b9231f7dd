"""Many runs: sweeps and what they say, reports, first differences, the smallest failure, known-bad stacks."""
