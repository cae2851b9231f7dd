"""`twin bench`: public navigation benchmarks, a module each."""
