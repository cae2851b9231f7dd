"""Many runs of one scenario, with other values and seeds, on as many processes and machines as there are."""
