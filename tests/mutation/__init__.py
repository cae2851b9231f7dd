"""Do the tests notice small wrong changes? `make mutate`; see mutate.py."""
