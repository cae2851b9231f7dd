"""Scenarios as tests: which ones a file makes, run side by side in processes of their own."""
