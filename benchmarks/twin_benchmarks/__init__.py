"""Public benchmarks of navigation, run in the twin: `twin bench`."""
