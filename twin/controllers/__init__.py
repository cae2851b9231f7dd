"""Controllers as pure classes: numbers in, numbers out, the same on a simulated and on a physical robot."""
