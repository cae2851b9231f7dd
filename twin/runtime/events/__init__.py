"""What happens to a run from outside of the robots: faults, and obstacles that come and go."""
