"""Model predictive path integral control: many noisy rollouts, averaged by how well they do."""
