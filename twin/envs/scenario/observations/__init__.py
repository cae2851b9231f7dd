"""Topics as arrays of numbers with bounds and units: a file for each kind."""
