"""Reports of runs for people: one HTML file, which needs no network and can be printed."""
